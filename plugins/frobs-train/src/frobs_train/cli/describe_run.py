"""Facts about a run folder for ``frobs show``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frobs_cli.formats import duration, number, percent

if TYPE_CHECKING:
    from frobs_train import Run


def is_run(path: Path) -> bool:
    """Return whether a folder is a run folder."""
    return (path / "config.yaml").is_file()


def describe_run(path: Path) -> dict[str, Any]:
    """Return the facts about a run: progress, contents, evaluations and configuration.

    ``success``, ``reward`` and ``length`` come from the last log row that includes finished episodes.
    """
    from frobs_train import Run
    from frobs_train.logs.progress import last_values

    run = Run.open(path)
    pictures = (picture for ending in ("png", "mp4") for picture in path.rglob(f"*.{ending}"))
    return {
        "kind": "run",
        "name": str(run.path),
        **{key: getattr(run.config, key) for key in ("environment", "environment_kwargs", "algorithm", "seed")},
        **last_values(path),
        "checkpoints": [checkpoint.steps for checkpoint in run.checkpoints],
        "best": _best(run),
        "threads": _threads(path),
        "files": sorted(str(picture.relative_to(path)) for picture in pictures),
        "evaluations": run.evaluations(),
        "changes": list(run.changes),
        "config": run.config.model_dump(),
    }


def readable_run(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts of :func:`describe_run` in a short, human-readable form."""
    shown: dict[str, Any] = {key: facts[key] for key in ("kind", "name", "environment")}
    shown |= facts["environment_kwargs"]
    if facts["config"]["randomize"]:
        shown["randomized"] = ", ".join(facts["config"]["randomize"])
    shown |= {key: facts[key] for key in ("algorithm", "seed")}
    if facts["steps"] is not None and facts["seconds"] is not None:
        shown["trained"] = f"{facts['steps']:,.0f} steps in {duration(facts['seconds'])}"
    if facts["success"] is not None:
        shown["success"] = f"{percent(facts['success'])} at the end of training"
    if facts["reward"] is not None:
        shown["reward"] = f"{number(facts['reward'])} per episode at the end of training"
    if facts["best"] is not None:
        shown["best"] = f"after {facts['best']:,} steps, according to the evaluations during training"
    shown |= {"threads": facts["threads"], "checkpoints": len(facts["checkpoints"]), "files": facts["files"]}
    shown["changes"] = [
        {"after": f"{change['steps']:,} steps", "setting": key, "was": values["from"], "is": values["to"]}
        for change in facts["changes"]
        for key, values in change["settings"].items()
    ]
    shown["evaluations"] = [_evaluation(evaluation) for evaluation in facts["evaluations"]]
    return shown


def _best(run: Run) -> int | None:
    from frobs_core.util.errors import CheckpointError

    try:
        return run.find_checkpoint("best")[0].steps
    except CheckpointError:
        return None


def _threads(path: Path) -> str | None:
    """Return a description of the processors and threads at the start of the run, or None if unknown."""
    from frobs_core.util.files import read_json
    from frobs_train import Threads

    try:
        return str(Threads(**read_json(path / "versions.json")["threads"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _evaluation(found: Mapping[str, Any]) -> dict[str, Any]:
    interval = found.get("success_interval")
    octants = found.get("success_by_octant") or {}
    steps_to_success = found.get("steps_to_success")
    worst = min((octant["success_rate"] for octant in octants.values()), default=None)
    return {
        "after": f"{found['steps']:,} steps",
        "episodes": f"{found['episodes']:,}",
        "success": percent(found.get("success_rate")),
        "95 % interval": f"{percent(interval[0])} to {percent(interval[1])}" if interval else None,
        "steps to success": None if steps_to_success is None else number(steps_to_success),
        "worst octant": percent(worst) if worst is not None else None,
        "reward": number(found["mean_reward"]),
        "simulator": found.get("simulator"),
        "randomized": ", ".join(found.get("randomize") or ()) or None,
        "seed": found.get("seed"),
    }
