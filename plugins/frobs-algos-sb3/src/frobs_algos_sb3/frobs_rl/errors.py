"""Errors that are also ValueErrors, as in FRobs_RL."""

from __future__ import annotations

from pathlib import Path

from frobs_core.errors import RunError


class LogFolderExistsError(RunError, ValueError):
    """The log folder already exists.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(
            f"the log folder {path} exists; change log_folder in the YAML file, or choose on_existing='increment' (the next "
            "free name), 'overwrite' (its logs are removed) or 'resume' (they are continued)."
        )


class NotTrainedError(RunError, ValueError):
    """The replay buffer cannot be saved before a model has been trained and saved."""
