"""Errors of commands.

ConfigurationError          defined in :mod:`frobs_core.util.errors`
├── SettingError            defined in :mod:`frobs_core.util.errors`
│   └── CommandLineError    a command-line argument cannot be used
├── MissingFileError        a file does not exist
└── TargetExistsError       an output file or folder already exists
"""

from __future__ import annotations

from pathlib import Path

from frobs_core.deprecation import renamed_attribute
from frobs_core.util.errors import ConfigurationError, SettingError


class CommandLineError(SettingError):
    """A command-line argument is invalid.

    Args:
        place: The option or argument, such as ``"--args"``.
        reason: The problem and how to fix it.
    """

    argument = renamed_attribute("argument", "place")


class MissingFileError(ConfigurationError):
    """A file does not exist.

    Args:
        path: The file or folder.
        advice: How to fix the problem, or a list of existing files.
    """

    def __init__(self, path: Path | str, advice: str) -> None:
        self.path, self.advice = Path(path), advice
        super().__init__(f"{path} does not exist; {advice}.")


class TargetExistsError(ConfigurationError):
    """An output file or folder already exists and would be overwritten.

    Args:
        path: The file or folder.
        advice: What to do instead.
    """

    def __init__(self, path: Path | str, advice: str) -> None:
        self.path, self.advice = Path(path), advice
        super().__init__(f"{path} exists; {advice}.")
