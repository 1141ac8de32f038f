"""Facts about trained policies and runs for ``frobs list`` and ``frobs show``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frobs_cli.formats import duration, number, percent, settings_text
from frobs_cli.providers import Provider

if TYPE_CHECKING:
    from frobs_core.plugins.records import EnvironmentRecord
    from frobs_train import Run


class TrainProvider(Provider):
    """Provider of facts about pretrained policies and run folders."""

    kind = "run"

    def environment(self, id: str, record: EnvironmentRecord) -> dict[str, Any]:
        return {"algorithm": record.algorithm, "pretrained": _pretrained(id) if record.pretrained else None}

    def column(self, facts: Mapping[str, Any]) -> tuple[str, str]:
        policy = facts.get("pretrained")
        if policy is None:
            return "pretrained", ""
        rate = policy.get("success_rate")
        return "pretrained", "damaged" if "error" in policy else "yes" if rate is None else percent(rate)

    def readable_environment(self, facts: Mapping[str, Any]) -> dict[str, Any]:
        policy = facts.get("pretrained")
        if not policy or "error" in policy:
            return {}
        return {"pretrained": _readable(str(facts["name"]), policy)}

    def describes(self, name: str) -> bool:
        return (Path(name) / "config.yaml").is_file()

    def describe(self, name: str) -> dict[str, Any]:
        """Return the facts about a run: progress, contents, evaluations and configuration.

        ``success``, ``reward`` and ``length`` come from the last log row that includes finished episodes.
        """
        from frobs_train import Run
        from frobs_train.logs.progress import last_values

        path = Path(name)
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

    def readable(self, facts: Mapping[str, Any]) -> dict[str, Any]:
        shown: dict[str, Any] = {key: facts[key] for key in ("kind", "name", "environment")}
        shown |= facts["environment_kwargs"]
        if isinstance(counts := facts["config"]["num_envs"], dict):
            trained_on = ", ".join(f"{count:,} × {name}" for name, count in counts.items())
            shown["simulator"] = f"trained on {trained_on}; evaluated on {facts['environment_kwargs']['simulator']}"
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


PROVIDER = TrainProvider()


def _pretrained(id: str) -> dict[str, Any]:
    """Return facts about an ID's trained policy, or ``{"error": message}`` if the policy file cannot be used."""
    from frobs_core.util.errors import FrobsError
    from frobs_deploy import DeployError
    from frobs_train.export.pretrained import describe_pretrained, read_pretrained

    try:
        return describe_pretrained(read_pretrained(id))
    except (FrobsError, DeployError) as error:
        return {"error": str(error)}


def _readable(id: str, found: Mapping[str, Any]) -> dict[str, Any]:
    shown = {"try it": f"frobs play {id} --pretrained"}
    if found["success_rate"] is not None:
        low, high = found["success_interval"]
        shown["success"] = (
            f"{percent(found['success_rate'])} of {found['episodes']:,} episodes with seed {found['evaluation_seed']}  "
            f"(95 % interval: {percent(low)} to {percent(high)})"
        )
    for simulator, rate in found["other_simulators"].items():
        shown[f"on {simulator}"] = percent(rate)
    if found["tracking_error"] is not None:
        shown["tracking error"] = f"{1e3 * found['tracking_error']:.1f} mm"
    shown["trained"] = f"{found['algorithm']}, {found['steps']:,} steps"
    if found["seconds"] is not None:
        shown["trained"] += f" in {duration(found['seconds'])}"
    if found["command"]:
        shown["by"] = found["command"]
    shown["license"] = found["license"] or "none given"
    shown["file"] = f"{found['file']}, {found['bytes'] / 1e3:,.0f} kB, SHA-256 {found['sha256']}"
    if found["commit"]:
        shown["commit"] = found["commit"]
    return shown


def _best(run: Run) -> int | None:
    from frobs_core.util.errors import CheckpointError

    try:
        return run.find_checkpoint("best")[0].steps
    except CheckpointError:
        return None


def _threads(path: Path) -> str | None:
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
        "simulator_kwargs": settings_text(found.get("simulator_kwargs")),
        "randomized": ", ".join(found.get("randomize") or ()) or None,
        "seed": found.get("seed"),
    }
