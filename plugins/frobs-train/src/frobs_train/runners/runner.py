"""Interface of runners, which run independent jobs on one or more machines.

A distribution registers a runner in the entry-point group ``frobs.runners``::

    [project.entry-points."frobs.runners"]
    ray = "frobs_ray.runner:RayRunner"
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_train.errors import JobsError
from frobs_train.training.monitor import Progress

if TYPE_CHECKING:
    from frobs_train.tuning.search import Search
    from frobs_train.tuning.study import StudyResult, TrialResult

GROUP = "frobs.runners"

LOCAL = "local"
"""Name of the runner that runs one job after another in this process."""

Report = Callable[[Progress], bool | None]
"""Function that a job calls with its progress. If the function returns False, the job should end early."""


@dataclass(frozen=True, kw_only=True)
class RunnerOptions:
    """Options of a runner.

    Attributes:
        address: Address of the cluster. Defaults to that of the environment variables, or else to a new cluster.
        processors: Number of processors per job, or None for the runner's default.
        memory: Memory per job [B], or None for the job's own estimate.
    """

    address: str | None = None
    processors: int | None = None
    memory: int | None = None


@dataclass(frozen=True, kw_only=True)
class Job:
    """A function call that may run in another process or on another machine.

    If the process or machine fails, the runner calls the function again with the same arguments. The function must
    then continue the work of the earlier call.

    Attributes:
        name: Name in progress reports and errors, such as ``"seed 3"``.
        function: ``"module:function"``. The function receives the arguments and ``report``, a ``Report``.
        arguments: Keyword arguments that can be pickled. Paths must be absolute.
        memory: Estimated memory of the job [B].
    """

    name: str
    function: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    memory: int = 0

    def call(self, report: Report) -> Any:
        """Run the job in this process and return its result."""
        module, _, name = self.function.partition(":")
        return getattr(import_module(module), name)(**self.arguments, report=report)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The result of a job, or the error that ended it.

    Attributes:
        index: Position of the job in the sequence of jobs.
        job: The job.
        result: Return value of the function, or None if the job failed.
        error: Exception that ended the job, or None if the job succeeded.
    """

    index: int
    job: Job
    result: Any = None
    error: Exception | None = None


class Runner(ABC):
    """Base class of runners.

    Args:
        options: Options of the runner. ConfigurationError is raised for options that the runner does not support.
    """

    name: ClassVar[str]

    def __init__(self, options: RunnerOptions) -> None:
        self.options = options

    @abstractmethod
    def run(
        self, jobs: Sequence[Job], folder: Path, on_progress: Callable[[int, Progress], None] | None = None
    ) -> Iterator[Outcome]:
        """Run jobs, and yield each outcome as soon as its job has ended.

        A failed job does not stop other jobs. Closing the iterator stops the jobs that are still running.

        Args:
            jobs: The jobs.
            folder: Existing folder to which the jobs write. The folder must have the same path on all machines.
            on_progress: Called with the index of a job and the progress of this job.

        Raises:
            ConfigurationError: The jobs cannot run because a machine does not meet their requirements.
        """

    @abstractmethod
    def tune(
        self,
        search: Search,
        on_trial: Callable[[StudyResult, TrialResult], None] | None = None,
        on_progress: Callable[[int, int, Progress], None] | None = None,
    ) -> StudyResult:
        """Search for settings. For the arguments and errors, see :func:`frobs_train.tune`."""


def raise_failures(outcomes: Sequence[Outcome]) -> None:
    """Raise JobsError if one of the ``outcomes`` is a failure."""
    failed = [(outcome.job.name, outcome.error) for outcome in outcomes if outcome.error is not None]
    if failed:
        raise JobsError(failed, len(outcomes)) from failed[0][1]


def runner_names() -> list[str]:
    """Return the names of all installed runners, starting with ``local``."""
    return [LOCAL, *sorted(entry.name for entry in entry_points(group=GROUP))]


def load_runner(name: str, options: RunnerOptions | None = None) -> Runner:
    """Return a runner by name.

    Args:
        name: ``"local"``, or the name of an installed runner.
        options: Options of the runner.

    Raises:
        UnknownNameError: No installed runner has this name.
        ConfigurationError: The runner does not support an option, or cannot be imported.
    """
    options = options or RunnerOptions()
    if name == LOCAL:
        from frobs_train.runners.local import LocalRunner

        return LocalRunner(options)
    entries = [entry for entry in entry_points(group=GROUP) if entry.name == name]
    if not entries:
        hint = "pip install frobs-ray" if name == "ray" else ""
        raise UnknownNameError("runner", name, runner_names(), hint)
    try:
        cls = entries[0].load()
    except ImportError as error:
        raise ConfigurationError(
            f"the runner '{name}' cannot be imported: {error}; install the missing package."
        ) from error
    runner: Runner = cls(options)
    return runner
