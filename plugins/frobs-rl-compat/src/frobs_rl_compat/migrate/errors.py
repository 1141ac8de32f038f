"""Errors of ``frobs migrate``."""

from __future__ import annotations

from pathlib import Path

from frobs_core.util.errors import ConfigurationError


class MigrationError(ConfigurationError):
    """A file or folder cannot be migrated.

    Args:
        path: The file or folder.
        reason: Description of the problem and its solution.
    """

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"{path}: {reason}")
