"""Errors that FRobs_RL's users know as ValueError."""

from __future__ import annotations

from pathlib import Path

from frobs_core.errors import RunError


class LogFolderExistsError(RunError, ValueError):
    """The log folder is there already.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(
            f"the log folder {path} exists; change log_folder in the YAML file, or choose on_existing='increment' (the next "
            "free name), 'overwrite' (its logs are removed) or 'resume' (they go on)."
        )


class NotTrainedError(RunError, ValueError):
    """Something was asked for that only a training makes."""
