"""Runs trials on the nodes of a cluster."""

from __future__ import annotations

import json
import logging
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ray import tune
from ray.actor import ActorHandle

from frobs_core.util.plain import spell_numbers, to_json
from frobs_ray.mailbox import Sender
from frobs_ray.nodes import Versions, difference_here
from frobs_train.runs.fork import copy_run, fork_run
from frobs_train.runs.run import is_run
from frobs_train.training.monitor import Progress
from frobs_train.training.threads import processors_limited_to
from frobs_train.tuning.search import Search
from frobs_train.tuning.study import REPORTS
from frobs_train.tuning.tune import run_folders, run_trial

_OWNER = "trial.json"
"""File in a Ray checkpoint that identifies the trial that wrote the checkpoint."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """Data that all trials of a search share.

    Attributes:
        search: The search with its settings.
        folder: Absolute path of the study's folder.
        mailbox: Mailbox that receives the progress of the trials.
        processors: Number of processors for each trial.
        expected: Software versions on the machine that started the search.
    """

    search: Search
    folder: Path
    mailbox: ActorHandle[Any]
    processors: int
    expected: Versions


def run_trial_on_ray(config: Mapping[str, Any], place: Place) -> None:
    """Run a trial and report its metric to Ray Tune.

    If an earlier process or node of the trial died, the run continues in its existing folder. Exceptions are reported
    as ``error``, because Ray would otherwise restart the trial.
    """
    logging.getLogger("frobs").setLevel(logging.ERROR)  # hide notices, because the command already shows the progress
    number, settings = int(tune.get_context().get_trial_name()), dict(config["settings"])
    if difference := difference_here(place.expected):
        tune.report({"error": difference})
        return
    search, sender = place.search, Sender(place.mailbox)
    population = search.pruner == "population"
    try:
        if population:
            search = frequent_checkpoints(search)
            _take_over(search, place.folder, number, settings)

        def report(step: int, value: float) -> bool:
            metrics = {"step": step, "value": value, "settings": settings}
            if not population:
                tune.report(metrics)
                return True
            with tempfile.TemporaryDirectory() as folder:
                tune.report(metrics, checkpoint=_checkpoint(Path(folder), search, place.folder, number, settings))
            return True

        def tell(index: int, progress: Progress) -> None:
            sender.send((number, index), progress)

        with processors_limited_to(place.processors):
            run_trial(search, place.folder, number, settings, report, tell, on_existing="resume")
    except Exception as error:
        tune.report({"error": f"{type(error).__name__}: {error}"})


def frequent_checkpoints(search: Search) -> Search:
    """Return a search whose runs write a checkpoint with each report, so that other trials can continue from it."""
    every = max(1, search.resolve().steps // REPORTS)
    return replace(search, settings=(*search.settings, f"checkpoint_every={every}"))


def _checkpoint(
    folder: Path, search: Search, study: Path, number: int, settings: Mapping[str, Any]
) -> tune.Checkpoint | None:
    """Return a copy of a trial's run that another trial can continue, or None if the run has no checkpoint yet."""
    path = _run_folder(search, study, number, settings)
    if not any((path / "checkpoints").glob("step_*")):
        return None
    copy_run(path, folder / "run")
    (folder / _OWNER).write_text(to_json({"number": number, "settings": spell_numbers(settings)}), "utf-8")
    found: Any = tune.Checkpoint.from_directory(folder)  # the declared return type is the base class
    checkpoint: tune.Checkpoint = found
    return checkpoint


def _take_over(search: Search, study: Path, number: int, settings: Mapping[str, Any]) -> None:
    """Continue from a better trial's run if Ray Tune has chosen such a trial."""
    checkpoint = tune.get_checkpoint()
    if checkpoint is None:
        return
    path = _run_folder(search, study, number, settings)
    with checkpoint.as_directory() as folder:
        owner = json.loads((Path(folder) / _OWNER).read_text("utf-8"))
        if owner == {"number": number, "settings": spell_numbers(settings)} and is_run(path):
            return  # this trial's own run, which may be ahead of the checkpoint
        path.parent.mkdir(parents=True, exist_ok=True)
        config = search.resolve(settings)
        fork_run(Path(folder) / "run", path, config.model_copy(update={"seed": config.seed or 0}))


def _run_folder(search: Search, study: Path, number: int, settings: Mapping[str, Any]) -> Path:
    return next(iter(run_folders(search, search.resolve(settings), study, number).values()))
