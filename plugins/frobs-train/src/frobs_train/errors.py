"""Errors of training runs.

RunError                    in :mod:`frobs_core.errors`, as algorithms raise it too
├── RunExistsError          the run folder exists
├── RunBusyError            another process is training in the run folder
└── TrainingError           the training run failed; says where, and what can be resumed
"""

from __future__ import annotations

from pathlib import Path

from frobs_core.errors import RunError


class RunExistsError(RunError):
    """The run folder is there already.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(
            f"the run folder {path} exists; choose another with --run-dir, remove it, continue it with "
            f"'frobs resume {path}', or say --on-existing increment, overwrite or resume."
        )


class RunBusyError(RunError):
    """Another process trains in the run folder.

    Args:
        path: The folder.
        pid: Of that process; None where it does not say.
        host: The machine that it runs on; None where it does not say.
    """

    def __init__(self, path: Path, pid: int | None = None, host: str | None = None) -> None:
        self.path = path
        self.pid = pid
        self.host = host
        who = "another process" if pid is None else f"process {pid}{f' on {host}' if host else ''}"
        super().__init__(
            f"{who} is training in {path}; wait until it has ended, or stop it with 'kill {pid or 'PID'}', which "
            "writes a checkpoint first. Evaluating, playing and plotting the run work meanwhile."
        )


class TrainingError(RunError):
    """The training failed: the environment or the algorithm raised.

    Args:
        path: The run's folder.
        steps: Environment steps that were taken.
        cause: What was raised, and where.
        resumable: Environment steps of the newest checkpoint; None: there is none yet.
    """

    def __init__(self, path: Path, steps: int, cause: str, resumable: int | None) -> None:
        self.path = path
        self.steps = steps
        self.cause = cause
        self.resumable = resumable
        since = "from the beginning" if resumable is None else f"from step {resumable:,}"
        super().__init__(
            f"the training in {path} failed after {steps:,} environment steps: {cause}. Mend it, then "
            f"'frobs resume {path}' continues {since}; --debug shows the traceback."
        )
