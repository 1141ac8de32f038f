"""Errors of data sets.

FrobsError          defined in :mod:`frobs_core.util.errors`
└── DataError       a data set cannot be read, written or used
"""

from __future__ import annotations

from pathlib import Path

from frobs_core.util.errors import FrobsError


class DataError(FrobsError):
    """A data set cannot be read, written or used.

    Args:
        path: The data set, or one of its files.
        reason: The problem and how to fix it.
    """

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path, self.reason = Path(path), reason
        super().__init__(f"{path}: {reason}")
