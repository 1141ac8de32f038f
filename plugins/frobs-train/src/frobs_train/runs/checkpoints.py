"""Checkpoints, which are written atomically: a checkpoint folder is either complete or absent."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from frobs_core.util.errors import CheckpointError, NonFiniteValueError
from frobs_core.util.files import sync
from frobs_train.runs import checksums

_NAME = re.compile(r"^step_(\d+)$")
_ASIDE = re.compile(r"^\.(step_\d+|best)\.(\d+|old)$")
_BEST = "best"


@dataclass(frozen=True)
class Checkpoint:
    """A complete checkpoint.

    Attributes:
        path: The folder.
        steps: Number of environment steps when the checkpoint was written.
    """

    path: Path
    steps: int

    def verify(self) -> None:
        """Check that the files of the checkpoint have not changed.

        Raises:
            CheckpointError: A file is missing, damaged or unexpected.
        """
        checksums.verify(self.path)


def list_checkpoints(folder: Path) -> list[Checkpoint]:
    """Return the complete checkpoints in a folder, oldest first, excluding ``best``."""
    if not folder.is_dir():
        return []
    named = ((path, _NAME.match(path.name)) for path in folder.iterdir())
    saved = [Checkpoint(path, int(match[1])) for path, match in named if match and (path / checksums.NAME).is_file()]
    return sorted(saved, key=lambda checkpoint: checkpoint.steps)


def newest_checkpoint(folder: Path) -> tuple[Checkpoint, list[str]]:
    """Return the newest undamaged checkpoint, and one message for each newer checkpoint that is damaged."""
    damaged = []
    for checkpoint in reversed(list_checkpoints(folder)):
        try:
            checkpoint.verify()
        except CheckpointError as error:
            damaged.append(str(error))
        else:
            return checkpoint, damaged
    reason = "; ".join(damaged) if damaged else "none was written"
    raise CheckpointError(f"{folder} contains no usable checkpoint: {reason}; start a new training run.")


def write_checkpoint(
    folder: Path, steps: int, save: Callable[[Path], None], keep: int, previous: Checkpoint | None = None
) -> Checkpoint:
    """Write a checkpoint atomically, and remove all but the newest checkpoints of the folder.

    If writing fails, CheckpointError is raised and earlier checkpoints remain intact. The function ``save`` writes the
    files to an empty folder. It may hard-link the files of the ``previous`` checkpoint instead of writing them again.
    """
    final = folder / f"step_{steps:09d}"
    _write(final, save, None if previous is None else previous.path)
    for old in list_checkpoints(folder)[:-keep]:
        _remove(old.path)
    return Checkpoint(final, steps)


def write_best(folder: Path, save: Callable[[Path], None]) -> Path:
    """Write the checkpoint ``best``. If writing fails, the previous ``best`` is kept."""
    _write(folder / _BEST, save, None)
    return folder / _BEST


def clean(folder: Path, beyond: int | None = None) -> list[Path]:
    """Remove the leftovers of a killed process, and rename checkpoints with more than ``beyond`` steps.

    Renamed checkpoints, whose new paths are returned, are ignored by :func:`list_checkpoints`. The caller must hold the
    run's lock.
    """
    if not folder.is_dir():
        return []
    if (folder / f".{_BEST}.old").is_dir() and not (folder / _BEST).exists():
        os.replace(folder / f".{_BEST}.old", folder / _BEST)
    renamed = []
    for path in sorted(folder.iterdir()):
        match = _NAME.match(path.name)
        if _ASIDE.match(path.name) or (match and not (path / checksums.NAME).is_file()):
            shutil.rmtree(path, ignore_errors=True)
        elif match and beyond is not None and int(match[1]) > beyond:
            target = path.with_name(f"damaged_{path.name}")
            shutil.rmtree(target, ignore_errors=True)
            os.replace(path, target)
            renamed.append(target)
    return renamed


def _write(final: Path, save: Callable[[Path], None], previous: Path | None) -> None:
    folder = final.parent
    aside, old = folder / f".{final.name}.{os.getpid()}", folder / f".{final.name}.old"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(aside, ignore_errors=True)
        aside.mkdir()
        save(aside)
        files = sorted(path for path in aside.rglob("*") if path.is_file())
        listed = checksums.write_checksums(aside, files, previous)
        for path in [*files, listed, *(path for path in aside.rglob("*") if path.is_dir()), aside]:
            sync(path)
        if final.exists():  # the previous best, or a checkpoint from before the run was resumed
            shutil.rmtree(old, ignore_errors=True)
            os.replace(final, old)
        os.replace(aside, final)
        sync(folder)
    except BaseException as error:
        shutil.rmtree(aside, ignore_errors=True)
        if old.is_dir() and not final.exists():
            os.replace(old, final)
        if isinstance(error, Exception) and not isinstance(error, NonFiniteValueError):
            raise CheckpointError(_reason(final, error)) from error
        raise
    shutil.rmtree(old, ignore_errors=True)


def _remove(path: Path) -> None:
    """Remove a checkpoint atomically. If the process is killed during the removal, no incomplete checkpoint remains."""
    aside = path.with_name(f".{path.name}.old")
    shutil.rmtree(aside, ignore_errors=True)
    try:
        os.replace(path, aside)
    except OSError:  # keep the folder; removal is tried again after the next checkpoint
        return
    shutil.rmtree(aside, ignore_errors=True)


def _reason(path: Path, error: Exception) -> str:
    text = f"checkpoint {path} cannot be written: {error}"
    existing = next((parent for parent in path.parents if parent.exists()), Path())
    try:
        free = shutil.disk_usage(existing).free / 2**20
        text += f"; {free:.1f} MiB are free there"
    except OSError:
        pass
    return (
        f"{text}. Free some space, or copy the run to another disk. Earlier checkpoints are intact; "
        "'frobs resume RUN' continues from the newest one."
    )
