"""Read and describe the trained policies of environment IDs without importing large packages."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from frobs_core.plugins import registry
from frobs_deploy import Bundle, BundleError, read_bundle


def read_pretrained(environment: str) -> Bundle:
    """Read the trained policy of an environment ID, which may have the form ``frobs_core:frobs/…``."""
    name = registry.bare_id(environment)
    bundle = read_bundle(registry.pretrained_path(environment))
    trained_in = registry.bare_id(str((bundle.manifest.get("environment") or {}).get("id")))
    if trained_in != name:
        raise BundleError(bundle.path, f"the policy was trained in {trained_in}, so it is not a policy for {name}.")
    return bundle


def describe_pretrained(bundle: Bundle) -> dict[str, Any]:
    """Return facts about a trained policy as plain Python types."""
    training: Mapping[str, Any] = bundle.manifest.get("training") or {}
    claimed = claimed_evaluation(bundle) or {}
    commit = (bundle.manifest.get("export") or {}).get("commit") or {}
    data = bundle.path.read_bytes()
    others = sorted({row["simulator"] for row in training.get("evaluations") or () if row.get("simulator")})
    return {
        **{key: training.get(key) for key in ("algorithm", "steps", "seconds", "command")},
        **{key: claimed.get(key) for key in ("success_rate", "success_interval", "tracking_error", "episodes")},
        "evaluation_seed": claimed.get("seed"),
        "other_simulators": {name: (claimed_evaluation(bundle, name) or {}).get("success_rate") for name in others},
        "license": bundle.manifest.get("license"),
        "commit": commit.get("commit"),
        "file": bundle.path.name,
        "bytes": len(data),
        "sha256": hashlib.sha256(data).hexdigest(),
    }


def claimed_evaluation(bundle: Bundle, simulator: str | None = None) -> Mapping[str, Any] | None:
    """Return the bundle's evaluation with the most episodes, or None if there is no suitable evaluation.

    Only evaluations of the nominal models count, in the given simulator or that of the training run.
    """
    evaluations = (bundle.manifest.get("training") or {}).get("evaluations") or []
    nominal = [
        row
        for row in evaluations
        if row.get("simulator") == simulator and not row.get("randomize") and row.get("simulator_kwargs") is None
    ]
    return max(nominal, key=lambda row: int(row.get("episodes") or 0), default=None)
