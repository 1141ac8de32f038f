"""The jobs that FRobs gives to a runner. Each continues what an earlier call has begun."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from frobs_train.configuration.config import RunConfig, algorithm_record, resolve_algorithm_config
from frobs_train.evaluation.evaluate import evaluate
from frobs_train.logs.progress import last_value, read_progress
from frobs_train.runners.runner import Job, Report
from frobs_train.runs.run import Run
from frobs_train.training.train import train

_PROCESS_MEMORY = 2**30  # [B] Python, the libraries and a hundred environments

_COLUMNS = {
    "steps": "train/steps",
    "seconds": "time/elapsed",
    "success": "episode/success",
    "reward": "episode/reward",
    "length": "episode/length",
}
"""Facts about a training run, and the columns of its log that have them."""


def training_job(config: RunConfig, run_dir: Path) -> Job:
    """Return the job that trains a run, or continues the run that is in the folder.

    Its result is a mapping with ``run``, ``environment``, ``algorithm``, ``seed``, ``steps``, ``seconds``, ``success``,
    ``reward`` and ``length``.
    """
    return Job(
        name=f"seed {config.seed}",
        function=f"{__name__}:train_run",
        arguments={"config": config.model_dump(), "run_dir": run_dir.absolute()},
        memory=estimate_memory(config),
    )


def evaluation_job(run: Path, **keywords: Any) -> Job:
    """Return the job that evaluates a run; the keywords are those of :func:`frobs_train.evaluate`."""
    return Job(
        name=str(run),
        function=f"{__name__}:evaluate_run",
        arguments={"run": run.absolute(), "keywords": keywords},
        memory=_PROCESS_MEMORY,
    )


def train_run(config: Mapping[str, Any], run_dir: Path, report: Report) -> dict[str, Any]:
    """Train a run, or continue it."""
    run = train(RunConfig(**config), run_dir, report, on_existing="resume")
    log = read_progress(run.path / "progress.csv")
    facts = {name: last_value(log.get(column, [])) for name, column in _COLUMNS.items()}
    trained = {"environment": run.config.environment, "algorithm": run.config.algorithm, "seed": run.config.seed}
    return {"run": run.path, **trained, **facts}


def evaluate_run(run: Path, keywords: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Evaluate a run."""
    return {"run": run, **evaluate(Run.open(run), **keywords).to_dict()}


def estimate_memory(config: RunConfig) -> int:
    """Return the memory [B] that training is expected to need: a process and the replay buffer.

    The buffer is the part that grows with the settings. It is taken to hold observations of 128 numbers; images are not
    considered.
    """
    settings = resolve_algorithm_config(algorithm_record(config.algorithm), config.algorithm_config)
    return _PROCESS_MEMORY + int(settings.get("buffer_size") or 0) * 2 * 128 * 4
