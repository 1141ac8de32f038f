"""The trained policies that come with environment IDs; nothing heavy is imported to tell of them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import gymnasium as gym

from frobs_core import registry
from frobs_core.deploy.bundle import Bundle, read_bundle
from frobs_core.errors import BundleError, RunError
from frobs_core.specs import EnvironmentRecord


def pretrained_ids() -> list[str]:
    """Return the IDs that come with a trained policy, sorted."""
    return [id for id, (_, record) in registry.environments().items() if record.pretrained]


def pretrained_path(record: EnvironmentRecord) -> Path:
    """Return the file that a record names.

    Raises:
        BundleError: Its package is not there, or the field is not of the form ``"package:path.frobs"``.
    """
    package, _, path = record.pretrained.partition(":")
    try:
        spec = find_spec(package)
    except (ImportError, ValueError):  # no name of a module
        spec = None
    folders = [Path(folder) for folder in (spec.submodule_search_locations or [])] if spec else []
    if not folders or not path:
        raise BundleError(
            record.pretrained,
            f"is no file in an installed package; the record of {record.id} is to say pretrained='package:path.frobs'.",
        )
    return next((folder / path for folder in folders if (folder / path).is_file()), folders[0] / path)


def read_pretrained(environment: str) -> Bundle:
    """Read the trained policy that comes with an ID.

    Args:
        environment: The ID; the form ``frobs_core:frobs/…`` is understood.

    Raises:
        UnknownNameError: No such ID.
        RunError: Nothing comes with it.
        BundleError: The file is missing, damaged, or of another ID.
    """
    name = environment.rpartition(":")[2]
    known = registry.environments()
    if name in known and known[name][1].pretrained:
        bundle = read_bundle(pretrained_path(known[name][1]))
        trained_in = str((bundle.manifest.get("environment") or {}).get("id")).rpartition(":")[2]
        if trained_in != name:
            raise BundleError(bundle.path, f"was trained in {trained_in}, and is no policy for {name}.")
        return bundle
    if name not in known and name not in gym.registry:
        registry.find_environment(name)  # says what exists
    others = pretrained_ids()
    raise RunError(
        f"no trained policy comes with {name}; train one with 'frobs train {name}'. "
        + (f"IDs with one: {', '.join(others)}." if others else "No installed ID has one.")
    )


def describe_pretrained(bundle: Bundle) -> dict[str, Any]:
    """Return what there is to know of a trained policy before it is used, in plain types."""
    training: Mapping[str, Any] = bundle.manifest.get("training") or {}
    claimed = claimed_evaluation(bundle) or {}
    commit = (bundle.manifest.get("export") or {}).get("commit") or {}
    data = bundle.path.read_bytes()
    others = sorted({row["simulator"] for row in training.get("evaluations") or () if row.get("simulator")})
    return {
        "algorithm": training.get("algorithm"),
        "steps": training.get("steps"),
        "seconds": training.get("seconds"),
        "command": training.get("command"),
        "success_rate": claimed.get("success_rate"),
        "success_interval": claimed.get("success_interval"),
        "tracking_error": claimed.get("tracking_error"),
        "episodes": claimed.get("episodes"),
        "evaluation_seed": claimed.get("seed"),
        "other_simulators": {name: (claimed_evaluation(bundle, name) or {}).get("success_rate") for name in others},
        "license": bundle.manifest.get("license"),
        "commit": commit.get("commit"),
        "file": bundle.path.name,
        "bytes": len(data),
        "sha256": hashlib.sha256(data).hexdigest(),
    }


def claimed_evaluation(bundle: Bundle, simulator: str | None = None) -> Mapping[str, Any] | None:
    """Return what ``frobs evaluate`` had found before the export, of the most episodes; None where it was not asked.

    Args:
        bundle: The bundle.
        simulator: Another than the training's; None: the training's.
    """
    found = (bundle.manifest.get("training") or {}).get("evaluations") or []
    nominal = [row for row in found if row.get("simulator") == simulator and not row.get("randomize")]
    return max(nominal, key=lambda row: int(row.get("episodes") or 0), default=None)
