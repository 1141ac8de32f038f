"""Checks that an environment has the spaces of a model.

The file contains a space only as a pickle, with a readable text next to it. The model is therefore built with the
environment's spaces, whose bounds are exact. The text is only compared.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.preprocessing import is_image_space, is_image_space_channels_first
from stable_baselines3.common.vec_env import VecTransposeImage

from frobs_algos_sb3.model_files.archive import ModelArchive
from frobs_algos_sb3.model_files.text import class_name
from frobs_core.util.errors import CheckpointError, ModelMismatchError

SPACES = ("observation_space", "action_space")

_COMPARED = ("_shape", "shape", "n", "low", "high")
"""Attributes of a space that are compared. Each version of gym and Gymnasium writes some of them."""

_PRINTED = {"precision": 8, "threshold": 1000, "edgeitems": 3, "linewidth": 75, "suppress": False, "sign": "-",
            "floatmode": "maxprec", "formatter": None}  # fmt: skip
"""NumPy's defaults, with which the bounds in a file are printed."""


def as_trained(space: gym.Space[Any]) -> gym.Space[Any]:
    """Return an observation space after stable-baselines3's conversion, which puts image channels first."""
    if isinstance(space, spaces.Dict):
        return spaces.Dict([(key, as_trained(inner)) for key, inner in space.spaces.items()])
    if isinstance(space, spaces.Box) and is_image_space(space) and not is_image_space_channels_first(space):
        return VecTransposeImage.transpose_space(space)
    return space


def check_spaces(archive: ModelArchive, found: tuple[gym.Space[Any], gym.Space[Any]]) -> None:
    """Compare the text of a model's spaces with the observation and action space of an environment."""
    for name, space in zip(SPACES, found, strict=True):
        written = archive.data.get(name)
        if not isinstance(written, dict):
            raise CheckpointError(
                f"{archive.path} is damaged: its file 'data' does not contain the attribute '{name}'."
            )
        saved = _describe(class_name(written.get(":type:")).rpartition(".")[2], written)
        compared = {key: getattr(space, key, None) for key in written}
        if saved != _describe(type(space).__name__, compared):
            raise ModelMismatchError(archive.path, name, saved, space)


def _describe(kind: str, attributes: dict[str, Any]) -> str:
    """Return a text such as ``"Box(shape=[1], low=[-2.], high=[2.])"``."""
    values = {key: attributes[key] for key in _COMPARED if attributes.get(key) is not None}
    with np.printoptions(**_PRINTED):  # type: ignore[arg-type]
        texts = [
            f"{key.lstrip('_')}={list(value) if isinstance(value, tuple) else value}" for key, value in values.items()
        ]
    return f"{kind}({', '.join(texts)})"
