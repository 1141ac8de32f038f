"""Errors that are also ValueErrors, as in FRobs_RL."""

from __future__ import annotations

from pathlib import Path

from frobs_core.util.errors import RunError


class LogFolderExistsError(RunError, ValueError):
    """The log folder already exists.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(
            f"the log folder {path} already exists; change log_folder in the YAML file, or choose "
            "on_existing='increment' "
            "(use the next free name), 'overwrite' (delete the old logs) or 'resume' (append to the old logs)."
        )


class NotTrainedError(RunError, ValueError):
    """The replay buffer cannot be saved before a model has been trained and saved."""
