"""What ``frobs show`` says about a run folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any


def is_run(path: Path) -> bool:
    """Tell a run's folder."""
    return (path / "config.yaml").is_file()


def describe_run(path: Path) -> dict[str, Any]:
    """Return the facts about a run: configuration, the last row of its log, checkpoints and evaluations."""
    from frobs_core.runs import Run

    run = Run.open(path)
    log = path / "progress.csv"
    files = sorted(item.name for item in path.iterdir() if item.suffix in (".png", ".mp4"))
    return {
        "kind": "run",
        "name": str(run.path),
        "checkpoints": [checkpoint.steps for checkpoint in run.checkpoints],
        "files": files,
        "config": run.config.model_dump(),
        "progress": _last_row(log) if log.is_file() else {},
        "evaluations": [_evaluation(found) for found in run.evaluations()],
    }


def _last_row(log: Path) -> dict[str, float]:
    from frobs_core.runs.progress import read_progress

    return {name: values[-1] for name, values in read_progress(log).items() if values}


def _evaluation(found: Mapping[str, Any]) -> dict[str, Any]:
    keys = ("steps", "episodes", "success_rate", "mean_reward", "mean_length", "simulator", "seed")
    return {key: found.get(key) for key in keys}
