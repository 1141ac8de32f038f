"""Checkpoints: folders that are complete or not there."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from frobs_core.errors import CheckpointError
from frobs_core.runs.files import sync

_NAME = re.compile(r"^step_(\d+)$")
_CHECKSUMS = "checksums.json"


@dataclass(frozen=True)
class Checkpoint:
    """A checkpoint that was written completely.

    Attributes:
        path: Its folder.
        steps: Environment steps at which it was written.
    """

    path: Path
    steps: int

    def verify(self) -> None:
        """Check that nothing in it has changed.

        Raises:
            CheckpointError: A file is missing or damaged.
        """
        try:
            checksums: dict[str, str] = json.loads((self.path / _CHECKSUMS).read_text("utf-8"))
        except (OSError, ValueError) as error:
            raise CheckpointError(f"checkpoint {self.path}: {_CHECKSUMS} cannot be read: {error}.") from error
        for name, expected in checksums.items():
            try:
                found = _checksum(self.path / name)
            except OSError as error:
                raise CheckpointError(f"checkpoint {self.path}: {name} cannot be read: {error.strerror}.") from error
            if found != expected:
                raise CheckpointError(f"checkpoint {self.path}: {name} is damaged (its checksum differs).")


def list_checkpoints(folder: Path) -> list[Checkpoint]:
    """Return the complete checkpoints of a folder, oldest first."""
    if not folder.is_dir():
        return []
    named = ((path, _NAME.match(path.name)) for path in folder.iterdir())
    found = [Checkpoint(path, int(match[1])) for path, match in named if match and (path / _CHECKSUMS).is_file()]
    return sorted(found, key=lambda checkpoint: checkpoint.steps)


def newest_checkpoint(folder: Path) -> tuple[Checkpoint, list[str]]:
    """Return the newest checkpoint that is undamaged, and one line for each damaged one that is newer.

    Raises:
        CheckpointError: There is none.
    """
    damaged = []
    for checkpoint in reversed(list_checkpoints(folder)):
        try:
            checkpoint.verify()
        except CheckpointError as error:
            damaged.append(str(error))
        else:
            return checkpoint, damaged
    reason = "; ".join(damaged) if damaged else "none was written"
    raise CheckpointError(f"{folder} holds no usable checkpoint: {reason}; train again.")


def write_checkpoint(folder: Path, steps: int, save: Callable[[Path], None], keep: int) -> Checkpoint:
    """Write a checkpoint beside its place and rename it into it, then remove the oldest.

    Args:
        folder: Of all checkpoints.
        steps: Environment steps so far.
        save: Writes into the empty folder that it is given.
        keep: How many stay.

    Raises:
        CheckpointError: It cannot be written; those before are intact, and nothing of it is left.
    """
    final = folder / f"step_{steps:09d}"
    aside = folder / f".{final.name}.{os.getpid()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(aside, ignore_errors=True)
        aside.mkdir()
        save(aside)
        files = sorted(path for path in aside.rglob("*") if path.is_file())
        checksums = {path.relative_to(aside).as_posix(): _checksum(path) for path in files}
        (aside / _CHECKSUMS).write_text(json.dumps(checksums, indent=2) + "\n", encoding="utf-8")
        for path in [*files, aside / _CHECKSUMS, *(path for path in aside.rglob("*") if path.is_dir()), aside]:
            sync(path)
        if final.exists():  # written by a run that was continued from before it
            shutil.rmtree(final)
        os.replace(aside, final)
        sync(folder)
    except Exception as error:
        shutil.rmtree(aside, ignore_errors=True)
        raise CheckpointError(_reason(final, error)) from error
    except BaseException:
        shutil.rmtree(aside, ignore_errors=True)
        raise
    for old in list_checkpoints(folder)[:-keep]:
        shutil.rmtree(old.path, ignore_errors=True)
    return Checkpoint(final, steps)


def _reason(path: Path, error: Exception) -> str:
    text = f"checkpoint {path} cannot be written: {error}"
    existing = next((parent for parent in path.parents if parent.exists()), Path())
    try:
        free = shutil.disk_usage(existing).free / 2**20
        text += f"; {free:.1f} MiB are free there"
    except OSError:
        pass
    return f"{text}. Free some space or choose another --run-dir; earlier checkpoints are intact."


def _checksum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
