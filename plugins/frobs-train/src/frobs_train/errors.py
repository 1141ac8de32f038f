"""Errors of training runs.

RunError                    defined in :mod:`frobs_core.util.errors`, because algorithms also raise it
├── RunExistsError          the run folder already exists
├── RunBusyError            another process is training in the run folder
├── EnvironmentFaultError   an environment raised an exception, or does not follow Gymnasium's interface
├── EndlessEpisodeError     an episode has not ended after many steps
├── TrainingError           training failed; the message contains the cause and the step to resume from
└── JobsError               at least one of several jobs failed

ConfigurationError          defined in :mod:`frobs_core.util.errors`
├── EnvironmentBuildError   an environment cannot be built with the given keywords
├── ComponentError          a wrapper or callback cannot be imported or built
├── SearchSpaceError        a search space cannot be used
└── StudyError              a study cannot be opened or continued
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from frobs_core.util.errors import ConfigurationError, RunError


class RunExistsError(RunError):
    """The run folder already exists.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(
            f"the run folder {path} already exists; choose another folder with --run-dir, remove the folder, continue "
            f"the run with 'frobs resume {path}', or pass --on-existing increment, overwrite or resume."
        )


class RunBusyError(RunError):
    """Another process is training in the run folder.

    Args:
        path: The folder.
        pid: ID of the other process, or None if unknown.
        host: Machine on which the other process runs, or None if unknown.
    """

    def __init__(self, path: Path, pid: int | None = None, host: str | None = None) -> None:
        self.path = path
        self.pid = pid
        self.host = host
        who = "another process" if pid is None else f"process {pid}{f' on {host}' if host else ''}"
        super().__init__(
            f"{who} is training in {path}; wait until the process ends, or stop it with 'kill {pid or 'PID'}', "
            "which writes a checkpoint first. Meanwhile, you can evaluate, play and plot the run."
        )


class EnvironmentFaultError(RunError):
    """An environment raised an exception, or does not follow Gymnasium's interface.

    Args:
        environment: Gymnasium ID.
        reason: The problem, its location and how to fix it.
    """

    def __init__(self, environment: str, reason: str) -> None:
        self.environment = environment
        self.reason = reason
        super().__init__(f"environment '{environment}' {reason}")


class EndlessEpisodeError(RunError):
    """An episode has not ended after many steps.

    Args:
        environment: Gymnasium ID.
        steps: Number of steps of the episode.
    """

    def __init__(self, environment: str, steps: int) -> None:
        self.environment = environment
        self.steps = steps
        super().__init__(
            f"an episode of environment '{environment}' has not ended after {steps:,} steps; give the environment a time "
            "limit with --set 'wrappers=[{name: gymnasium.wrappers:TimeLimit, max_episode_steps: 1000}]' in training, or "
            "allow longer episodes with --longest-episode N (in training: --set longest_episode=N)."
        )


class TrainingError(RunError):
    """Training failed because the environment or the algorithm raised an exception.

    Args:
        path: The run's folder.
        steps: Number of environment steps taken so far.
        cause: The exception and its location.
        resumable: Number of environment steps at the newest checkpoint, or None if no checkpoint exists yet.
    """

    def __init__(self, path: Path, steps: int, cause: str, resumable: int | None) -> None:
        self.path = path
        self.steps = steps
        self.cause = cause
        self.resumable = resumable
        since = "from the beginning" if resumable is None else f"from step {resumable:,}"
        super().__init__(
            f"the training run in {path} failed after {steps:,} environment steps: {cause}. Fix the cause, then "
            f"continue {since} with 'frobs resume {path}'; --debug shows the traceback."
        )


class JobsError(RunError):
    """At least one of several jobs failed, and all other jobs are complete.

    Args:
        failed: Name and error of each failed job.
        total: Total number of jobs.
    """

    command_exit_code = 1  # exit code 2 would mean invalid user input

    def __init__(self, failed: Sequence[tuple[str, Exception]], total: int) -> None:
        self.failed = tuple(failed)
        self.total = total
        lines = [f"{name}: {error}" for name, error in failed]
        super().__init__(f"{len(failed)} of {total} jobs failed. " + "\n  ".join(lines))


_UNEXPECTED = re.compile(r"unexpected keyword argument '(\w+)'")


class EnvironmentBuildError(ConfigurationError):
    """An environment cannot be built with the given keyword arguments.

    Args:
        environment: Gymnasium ID.
        keywords: Keyword arguments of the environment.
        cause: Exception that the environment raised.
    """

    def __init__(self, environment: str, keywords: Mapping[str, Any], cause: Exception) -> None:
        self.environment = environment
        self.keywords = dict(keywords)
        self.cause = cause
        unknown = _UNEXPECTED.search(str(cause)) if isinstance(cause, TypeError) else None
        reason = (
            f"it does not accept the keyword '{unknown[1]}'; remove it from the environment's keywords"
            if unknown is not None and unknown[1] in keywords
            else f"{type(cause).__name__}: {cause}"
        )
        given = ", ".join(f"{key}={value!r}" for key, value in keywords.items())
        super().__init__(f"environment '{environment}' cannot be built{f' with {given}' if given else ''}: {reason}")


class ComponentError(ConfigurationError):
    """A wrapper or callback cannot be imported or built.

    Args:
        kind: ``"wrapper"`` or ``"callback"``.
        name: ``"package.module:Name"``.
        reason: The problem and its solution.
    """

    def __init__(self, kind: str, name: str, reason: str) -> None:
        self.kind = kind
        self.name = name
        self.reason = reason
        super().__init__(f"{kind} '{name}' {reason}")


class SearchSpaceError(ConfigurationError):
    """A search space cannot be used.

    Args:
        reason: The problem and its solution.
        key: Setting that is invalid, or None if the error concerns the whole search space.
    """

    def __init__(self, reason: str, key: str | None = None) -> None:
        self.key = key
        self.reason = reason
        super().__init__(reason)


class StudyError(ConfigurationError):
    """A study cannot be opened or continued.

    Args:
        study: Name or storage of the study.
        reason: The problem and its solution.
    """

    def __init__(self, study: str, reason: str) -> None:
        self.study = study
        self.reason = reason
        super().__init__(f"study '{study}' {reason}")
