"""Writes a model in stable-baselines3's zip format, and a JSON file with the attributes that the format pickles."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.type_aliases import TrainFreq

from frobs_algos.spaces import space_from_json, space_to_json
from frobs_algos_sb3.model_files.archive import ModelArchive
from frobs_core.util.errors import CheckpointError, ConfigurationError
from frobs_core.util.files import write_aside, write_json

FORMAT = 1
"""Version of the JSON file's format."""

MAX_BYTES = 16 * 2**20
"""Maximum size of a JSON file."""


def sidecar_path(path: Path) -> Path:
    """Return the path of a model's JSON file, such as ``td3.json`` for ``td3.zip``."""
    return path.with_suffix(".json")


def save_model(model: BaseAlgorithm, path: Path, notes: Mapping[str, Any] | None = None) -> None:
    """Write a model. Each file is written to a temporary path and then renamed.

    Raises:
        OSError: The disk is full, or the folder cannot be written.
    """
    write_aside(path, lambda aside: model.save(aside))
    write_json(
        sidecar_path(path),
        {
            "format": FORMAT,
            "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            "algorithm": type(model).__name__.lower(),
            "stable_baselines3": version("stable-baselines3"),
            "num_timesteps": model.num_timesteps,
            **_attributes(model),
            **(notes or {}),
        },
    )


def _attributes(model: BaseAlgorithm) -> dict[str, Any]:
    """Return the attributes that a zip file contains only as pickles or with rounded numbers, as JSON values."""
    attributes: dict[str, Any] = {}
    for name in ("observation_space", "action_space"):
        try:
            attributes[name] = space_to_json(getattr(model, name))
        except ConfigurationError:
            continue
    frequency = getattr(model, "train_freq", None)
    if isinstance(frequency, TrainFreq):
        attributes["train_freq"] = [int(frequency.frequency), frequency.unit.value]
    noise = getattr(model, "action_noise", None)
    if type(noise) is NormalActionNoise:
        attributes["action_noise"] = {"mean": noise._mu.tolist(), "sigma": noise._sigma.tolist()}
    return attributes


def read_sidecar(archive: ModelArchive) -> dict[str, Any]:
    """Return the attributes in a model's JSON file, or ``{}`` if it is missing or belongs to another model."""
    path = sidecar_path(archive.path)
    try:
        if path.stat().st_size > MAX_BYTES:
            return {}
        saved = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(saved, dict) or saved.get("format") != FORMAT:
        return {}
    if saved.get("sha256") != hashlib.sha256(archive.content).hexdigest():
        return {}
    try:
        return _read_attributes(saved)
    except (CheckpointError, KeyError, TypeError, ValueError, IndexError) as error:
        raise CheckpointError(f"{path} is damaged: {error}; delete this file to open the model without it.") from error


def _read_attributes(saved: Mapping[str, Any]) -> dict[str, Any]:
    import numpy as np

    attributes: dict[str, Any] = {
        name: space_from_json(saved[name]) for name in ("observation_space", "action_space") if name in saved
    }
    if "train_freq" in saved:
        count, unit = saved["train_freq"]
        if unit not in ("step", "episode"):
            raise ValueError(f"train_freq has the unit {unit!r}")
        attributes["train_freq"] = (int(count), unit)
    if "action_noise" in saved:
        mean, sigma = (np.array(saved["action_noise"][key], np.float64) for key in ("mean", "sigma"))
        attributes["action_noise"] = NormalActionNoise(mean, sigma)
    return attributes
