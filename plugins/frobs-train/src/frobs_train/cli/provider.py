"""Facts about trained policies and runs for ``frobs list`` and ``frobs show``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frobs_cli.formats import duration, percent
from frobs_cli.providers import Provider
from frobs_train.cli.describe_run import describe_run, is_run, readable_run

if TYPE_CHECKING:
    from frobs_core.plugins.records import EnvironmentRecord


class TrainProvider(Provider):
    """Provider of facts about pretrained policies and run folders."""

    kind = "run"

    def environment(self, id: str, record: EnvironmentRecord) -> dict[str, Any]:
        """Return the entry ``pretrained``: facts about the ID's trained policy, or None if no such policy exists."""
        return {"pretrained": _pretrained(id) if record.pretrained else None}

    def column(self, facts: Mapping[str, Any]) -> tuple[str, str]:
        """Return the column heading and the success rate of the pretrained policy."""
        policy = facts.get("pretrained")
        if policy is None:
            return "pretrained", ""
        rate = policy.get("success_rate")
        return "pretrained", "damaged" if "error" in policy else "yes" if rate is None else percent(rate)

    def readable_environment(self, facts: Mapping[str, Any]) -> dict[str, Any]:
        """Return the entry ``pretrained`` in human-readable form."""
        policy = facts.get("pretrained")
        if not policy or "error" in policy:
            return {}
        return {"pretrained": _readable(str(facts["name"]), policy)}

    def describes(self, name: str) -> bool:
        """Return whether a path is a run folder."""
        return is_run(Path(name))

    def describe(self, name: str) -> dict[str, Any]:
        """Return the facts about a run."""
        return describe_run(Path(name))

    def readable(self, facts: Mapping[str, Any]) -> dict[str, Any]:
        """Return the facts about a run in human-readable form."""
        return readable_run(facts)


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
