"""Jobs for runners. A job can be run again after an interruption."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from frobs_core.kernel.policies import is_path
from frobs_train.configuration.config import RunConfig, algorithm_record, resolve_algorithm_config
from frobs_train.evaluation.evaluate import evaluate
from frobs_train.logs.progress import last_values
from frobs_train.runners.runner import Job, Report
from frobs_train.runs.policy import open_policy
from frobs_train.training.train import train

_PROCESS_MEMORY = 2**30  # memory [B] used by Python, the libraries and a hundred environments


def training_job(config: RunConfig, run_dir: Path) -> Job:
    """Return a job that starts a training run, or continues an existing run in the folder.

    The result of the job is described in :func:`frobs_train.train_seeds`.
    """
    return Job(
        name=f"seed {config.seed}",
        function=f"{__name__}:train_run",
        arguments={"config": config.model_dump(), "run_dir": run_dir.absolute()},
        memory=estimate_memory(config),
    )


def evaluation_job(
    run: Path | str,
    policy: Path | str | None = None,
    *,
    settings: Sequence[str] = (),
    trust: bool = False,
    **keywords: Any,
) -> Job:
    """Return a job that evaluates a policy with keyword arguments of :func:`frobs_train.evaluate`.

    For the other arguments, see :func:`frobs_train.open_policy`. The result of the job contains ``run`` and the fields
    of :class:`frobs_train.Evaluation`.
    """
    return Job(
        name=str(run),
        function=f"{__name__}:evaluate_run",
        arguments={
            "run": Path(run).absolute() if policy is None else str(run),
            "policy": Path(policy).absolute() if policy is not None and is_path(policy) else policy,
            "settings": tuple(settings),
            "trust": trust,
            "keywords": keywords,
        },
        memory=_PROCESS_MEMORY,
    )


def train_run(config: Mapping[str, Any], run_dir: Path, report: Report) -> dict[str, Any]:
    """Start a training run, or continue an existing run."""
    run = train(RunConfig(**config), run_dir, report, on_existing="resume")
    trained = {key: getattr(run.config, key) for key in ("environment", "algorithm", "seed")}
    return {"run": run.path, **trained, **last_values(run.path)}


def evaluate_run(
    run: Path | str,
    keywords: Mapping[str, Any],
    report: Report,
    policy: Path | str | None = None,
    settings: Sequence[str] = (),
    trust: bool = False,
) -> dict[str, Any]:
    """Evaluate a policy."""
    opened = open_policy(run, policy, settings=settings, trust=trust)
    return {"run": opened.path, **evaluate(opened, **keywords).to_dict()}


def estimate_memory(config: RunConfig) -> int:
    """Return the estimated memory [B] of a training process, including its replay buffer.

    The buffer size depends on the settings. The estimate assumes observations of 128 numbers and ignores images.
    """
    settings = resolve_algorithm_config(algorithm_record(config.algorithm), config.algorithm_config)
    return _PROCESS_MEMORY + int(settings.get("buffer_size") or 0) * 2 * 128 * 4
