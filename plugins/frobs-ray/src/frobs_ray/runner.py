"""The runner ``ray``, which runs jobs in parallel on the nodes of a cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

import ray
from ray.exceptions import RayError

from frobs_core.util.errors import ParameterValueError
from frobs_ray.cluster import connect
from frobs_ray.errors import RemoteJobError
from frobs_ray.jobs import RETRIES, Answer, run_job
from frobs_ray.mailbox import collect, open_mailbox
from frobs_ray.nodes import check_nodes, check_resources, flat_versions
from frobs_train.runners.runner import Job, Outcome, Runner
from frobs_train.training.monitor import Progress
from frobs_train.tuning.search import Search
from frobs_train.tuning.study import StudyResult, TrialResult

_POLL = 0.5  # [s]
_PATIENCE = 120  # [s] maximum time for interrupted jobs to write their checkpoints


class RayRunner(Runner):
    """Runs jobs in parallel on an existing Ray cluster, or on a new Ray cluster on this machine."""

    name: ClassVar[str] = "ray"

    @property
    def address(self) -> str | None:
        """Address of the cluster to join, or None to start a cluster on this machine."""
        return self.options.address or os.environ.get("RAY_ADDRESS") or None

    @property
    def processors(self) -> int:
        """Number of processors for each job."""
        return self.options.processors or 1

    def run(
        self, jobs: Sequence[Job], folder: Path, on_progress: Callable[[int, Progress], None] | None = None
    ) -> Iterator[Outcome]:
        """Run jobs on the cluster, and yield each job's outcome as soon as the job ends.

        If the node or process of a job dies, the job is restarted on any node. On Ctrl-C, the running jobs write
        checkpoints.

        Args:
            jobs: The jobs.
            folder: Folder for the output of the jobs, to which every node must have access.
            on_progress: Function that is called with the index and the progress of a job.
        """
        _check_env_runners(jobs)
        with connect(self.address):
            sizes = [self.options.memory or job.memory for job in jobs]
            check_resources(self.processors, max(sizes, default=0))
            check_nodes(folder)
            mailbox, expected = open_mailbox(), flat_versions()
            task = ray.remote(run_job)
            pending = {}
            for index, (job, size) in enumerate(zip(jobs, sizes, strict=True)):
                placed = task.options(num_cpus=self.processors, memory=size, max_retries=RETRIES)
                pending[placed.remote(job, index, mailbox, self.processors, expected)] = index
            try:
                while pending:
                    ready, _ = ray.wait(list(pending), timeout=_POLL)
                    if on_progress is not None:
                        for index, progress in collect(mailbox).items():
                            on_progress(index, progress)
                    for reference in ready:
                        index = pending.pop(reference)
                        yield _outcome(reference, index, jobs[index])
            finally:
                _cancel(list(pending))

    def tune(
        self,
        search: Search,
        on_trial: Callable[[StudyResult, TrialResult], None] | None = None,
        on_progress: Callable[[int, int, Progress], None] | None = None,
    ) -> StudyResult:
        from frobs_ray.tuning import tune_on_ray

        return tune_on_ray(self, search, on_trial, on_progress)


def _check_env_runners(jobs: Sequence[Job]) -> None:
    """Raise ParameterValueError if a job would wait for processors that the jobs themselves occupy."""
    for job in jobs:
        count = job.arguments.get("config", {}).get("algorithm_config", {}).get("num_env_runners")
        if count:
            raise ParameterValueError(
                "algorithm_config.num_env_runners",
                count,
                "0 with --runner ray, because the jobs occupy the processors; without --runner, one training run uses "
                "the whole cluster",
            )


def _outcome(reference: ray.ObjectRef[Answer], index: int, job: Job) -> Outcome:
    try:
        result, message, trace = ray.get(reference)
    except RayError as error:
        reason = " ".join(str(error).split())
        return Outcome(index=index, job=job, error=RemoteJobError(job.name, reason, ""))
    if message is not None:
        return Outcome(index=index, job=job, error=RemoteJobError(job.name, message, trace))
    return Outcome(index=index, job=job, result=result)


def _cancel(references: list[Any]) -> None:
    """Interrupt tasks as Ctrl-C does, and wait until the tasks have written their checkpoints."""
    for reference in references:
        ray.cancel(reference, force=False)
    if references:
        ray.wait(references, num_returns=len(references), timeout=_PATIENCE)
