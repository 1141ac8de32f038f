"""Errors of parity measurements."""

from __future__ import annotations

from pathlib import Path

from frobs_core.util.errors import ConfigurationError


class ActionFileError(ConfigurationError):
    """An action file cannot be read, or does not match the environment.

    Args:
        path: Path of the action file.
        reason: Description of the problem, and how to fix it.
    """

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"{path}: {reason}")
