"""Jobs for runners. Each job continues an earlier, interrupted call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from frobs_train.configuration.config import RunConfig, algorithm_record, resolve_algorithm_config
from frobs_train.evaluation.evaluate import evaluate
from frobs_train.export.bundle_run import open_pretrained, open_run_or_bundle
from frobs_train.logs.progress import last_value, read_progress
from frobs_train.runners.runner import Job, Report
from frobs_train.runs.expert_run import ExpertRun
from frobs_train.runs.run import Run
from frobs_train.training.train import train

_PROCESS_MEMORY = 2**30  # [B] for Python, the libraries and a hundred environments

PolicyKind = Literal["run", "pretrained", "expert"]
"""Kind of policy: a run folder or bundle, the trained policy of an environment ID, or the expert of its task."""

_COLUMNS = {
    "steps": "train/steps",
    "seconds": "time/elapsed",
    "success": "episode/success",
    "reward": "episode/reward",
    "length": "episode/length",
}
"""Facts about a training run, and the columns of its log that contain them."""


def training_job(config: RunConfig, run_dir: Path) -> Job:
    """Return the job that trains a run, or continues the run in the folder.

    The result is described in :func:`frobs_train.train_seeds`.
    """
    return Job(
        name=f"seed {config.seed}",
        function=f"{__name__}:train_run",
        arguments={"config": config.model_dump(), "run_dir": run_dir.absolute()},
        memory=estimate_memory(config),
    )


def evaluation_job(
    run: Path | str,
    kind: PolicyKind = "run",
    *,
    settings: Sequence[str] = (),
    trust: bool = False,
    **keywords: Any,
) -> Job:
    """Return the job that evaluates a policy. Its result is ``run`` and the fields of :class:`frobs_train.Evaluation`.

    Args:
        run: Run folder or bundle, or an environment ID for the other kinds.
        kind: ``"run"``; ``"pretrained"``: the trained policy of the ID; ``"expert"``: the expert of its task.
        settings: Settings of an expert's environment.
        trust: Whether a bundle may name files, modules and wrappers to import.
        keywords: Keywords of :func:`frobs_train.evaluate`.
    """
    return Job(
        name=str(run),
        function=f"{__name__}:evaluate_run",
        arguments={
            "run": Path(run).absolute() if kind == "run" else str(run),
            "kind": kind,
            "settings": tuple(settings),
            "trust": trust,
            "keywords": keywords,
        },
        memory=_PROCESS_MEMORY,
    )


def train_run(config: Mapping[str, Any], run_dir: Path, report: Report) -> dict[str, Any]:
    """Train a run, or continue it."""
    run = train(RunConfig(**config), run_dir, report, on_existing="resume")
    log = read_progress(run.path / "progress.csv")
    facts = {name: last_value(log.get(column, [])) for name, column in _COLUMNS.items()}
    trained = {"environment": run.config.environment, "algorithm": run.config.algorithm, "seed": run.config.seed}
    return {"run": run.path, **trained, **facts}


def evaluate_run(
    run: Path | str,
    keywords: Mapping[str, Any],
    report: Report,
    kind: PolicyKind = "run",
    settings: Sequence[str] = (),
    trust: bool = False,
) -> dict[str, Any]:
    """Evaluate a policy."""
    if kind == "expert":
        opened: Run = ExpertRun(str(run), settings)
    else:
        opened = open_pretrained(str(run)) if kind == "pretrained" else open_run_or_bundle(run, trust)
    return {"run": opened.path, **evaluate(opened, **keywords).to_dict()}


def estimate_memory(config: RunConfig) -> int:
    """Return the memory [B] that training is expected to need: a process and the replay buffer.

    The size of the buffer depends on the settings. Observations are assumed to have 128 numbers; images are ignored.
    """
    settings = resolve_algorithm_config(algorithm_record(config.algorithm), config.algorithm_config)
    return _PROCESS_MEMORY + int(settings.get("buffer_size") or 0) * 2 * 128 * 4
