"""Write and verify the checksums of a checkpoint's files."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from pathlib import Path

from frobs_core.util.budgets import BUDGETS
from frobs_core.util.errors import CheckpointError
from frobs_core.util.files import check_regular, read_json
from frobs_core.util.plain import to_json

NAME = "checksums.json"
"""Name of the file that lists the checksums. A checkpoint folder is complete if it contains this file."""


def write_checksums(folder: Path, files: Iterable[Path], previous: Path | None = None) -> Path:
    """Write the checksums of files to a file in their folder, and return the path of this file.

    If a file is a hard link to a file in ``previous``, its checksum is copied from ``previous``.
    """
    known = {} if previous is None else _read_if_possible(previous)
    checksums = {}
    for path in files:
        name = path.relative_to(folder).as_posix()
        same = name in known and previous is not None and _is_same(path, previous / name)
        checksums[name] = known[name] if same else _checksum(path)
    target = folder / NAME
    target.write_text(to_json(checksums, indent=2) + "\n", encoding="utf-8")
    return target


def verify(folder: Path) -> None:
    """Raise CheckpointError if a file in a checkpoint folder is missing, damaged or unexpected."""
    try:
        checksums = read_json(folder / NAME)
    except OSError as error:
        raise CheckpointError(f"checkpoint {folder}: {NAME} cannot be read: {error.strerror}.") from error
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()} - {NAME}
    for name in sorted(there.difference(checksums)):
        raise CheckpointError(f"checkpoint {folder}: {name} has no checksum; {NAME} is damaged.")
    for name, expected in checksums.items():
        if name not in there:  # not opened, because it may be a FIFO or lead outside of the folder
            raise CheckpointError(f"checkpoint {folder}: {name} is missing, or not a regular file.")
        try:
            if name.endswith(".json"):
                check_regular(folder / name, BUDGETS["run folder"]["bytes of a JSON file"])
            actual = _checksum(folder / name)
        except OSError as error:
            raise CheckpointError(f"checkpoint {folder}: {name} cannot be read: {error.strerror}.") from error
        if actual != expected:
            raise CheckpointError(f"checkpoint {folder}: {name} is damaged (its checksum differs).")


def _read_if_possible(folder: Path) -> dict[str, str]:
    try:
        return read_json(folder / NAME)
    except OSError:
        return {}


def _is_same(path: Path, other: Path) -> bool:
    try:
        return os.path.samefile(path, other)
    except OSError:
        return False


def _checksum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
