"""Runner that runs jobs in this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import ClassVar

from frobs_core.util.errors import ConfigurationError
from frobs_train.runners.runner import LOCAL, Job, Outcome, Runner, RunnerOptions
from frobs_train.training.monitor import Progress
from frobs_train.tuning.search import Search
from frobs_train.tuning.study import StudyResult, TrialResult
from frobs_train.tuning.tune import tune


class LocalRunner(Runner):
    """Runner that runs one job after another in this process, so that each job can use all processors."""

    name: ClassVar[str] = LOCAL

    def __init__(self, options: RunnerOptions) -> None:
        super().__init__(options)
        if options != RunnerOptions():
            raise ConfigurationError(
                "the local runner does not support --ray-address, --cpus or --memory; omit these options, or add "
                "--runner ray."
            )

    def run(
        self, jobs: Sequence[Job], folder: Path, on_progress: Callable[[int, Progress], None] | None = None
    ) -> Iterator[Outcome]:
        for index, job in enumerate(jobs):

            def report(progress: Progress, index: int = index) -> None:
                if on_progress is not None:
                    on_progress(index, progress)

            try:
                result = job.call(report)
            except Exception as error:
                yield Outcome(index=index, job=job, error=error)
            else:
                yield Outcome(index=index, job=job, result=result)

    def tune(
        self,
        search: Search,
        on_trial: Callable[[StudyResult, TrialResult], None] | None = None,
        on_progress: Callable[[int, int, Progress], None] | None = None,
    ) -> StudyResult:
        return tune(search, on_trial, on_progress)
