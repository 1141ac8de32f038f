"""Continue a copy of a run with different algorithm settings, for population-based training."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from frobs_train.configuration.config import RunConfig
from frobs_train.logs.services import SERVICES
from frobs_train.runs.history import describe_change, write_history
from frobs_train.runs.lock import NAME as LOCK
from frobs_train.runs.run import Run


def copy_run(source: Path, target: Path) -> None:
    """Copy the files needed to continue a run to a new folder. Checkpoint files are hard-linked.

    The copy has log rows of its own, so it starts new runs in Weights & Biases and MLflow.
    """
    left_out = {LOCK, *(f"{name}.json" for name in SERVICES)}
    target.mkdir(parents=True)
    for path in source.iterdir():
        if path.is_file() and path.name not in left_out:
            shutil.copy2(path, target / path.name)
    if (source / "checkpoints").is_dir():
        newest = Run.open(source).newest_checkpoint()[0].path
        shutil.copytree(newest, target / "checkpoints" / newest.name, copy_function=_link)


def fork_run(source: Path, path: Path, config: RunConfig) -> Run:
    """Replace a run folder with a copy of another run, and change the algorithm settings of the copy.

    The other run has a checkpoint, and no process is training in ``path``. The copy can be resumed.
    """
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    shutil.rmtree(aside, ignore_errors=True)
    copy_run(source, aside)
    run = Run.open(aside)
    steps = run.newest_checkpoint()[0].steps
    changes = run.changes if config == run.config else (*run.changes, describe_change(run.config, config, steps))
    write_history(aside, config, changes)
    shutil.rmtree(path, ignore_errors=True)
    os.replace(aside, path)
    return Run.open(path)


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:  # the folders are on different disks
        shutil.copy2(source, target)
