"""Check of the observations that the networks of stable-baselines3 can process."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.preprocessing import is_image_space

from frobs_algos.encoder import SMALLEST
from frobs_algos.spaces import subspaces
from frobs_core.util.errors import FLATTEN_HINT, IncompatibleSpaceError

_SMALLEST_IMAGE = {None: 36, "NatureCNN": 36, "CombinedExtractor": 36, "SpatialSoftmax": SMALLEST}
"""Smallest width and height of an image that the convolutions of a features extractor can process [pixels]."""


def check_observation_space(owner: str, space: gym.Space[Any], extractor: str | None) -> None:
    """Check that the networks can process observations of a space."""
    smallest = _SMALLEST_IMAGE.get(extractor, 0)
    if extractor == "SpatialSoftmax" and not any(map(is_image_space, subspaces(space).values())):
        raise IncompatibleSpaceError(
            owner, space, "has no pictures for the features extractor SpatialSoftmax; remove features_extractor_class."
        )
    if isinstance(space, spaces.Tuple):
        raise IncompatibleSpaceError(
            owner, space, f"cannot learn from observations that are tuples ({space}); {FLATTEN_HINT}."
        )
    for key, part in subspaces(space).items():
        name = f"the observation '{key}'" if key else "the observation"
        if isinstance(part, spaces.Dict | spaces.Tuple):
            problem = f"{name} is a {type(part).__name__} inside a Dict, which the networks do not support"
        elif isinstance(part, spaces.Discrete | spaces.MultiDiscrete) and np.any(part.start):
            problem = f"{name} is {part}, but the networks need values that start at 0"
        elif part.shape == () and isinstance(part, spaces.Box):
            problem = f"{name} is a number of shape (), but the networks need an array"
        elif is_image_space(part) and min(np.sort(part.shape or ())[-2:]) < smallest:
            problem = (
                f"{name} is an image of shape {part.shape}, but the convolutions need at least {smallest} × "
                f"{smallest} pixels. Enlarge the image with the wrapper ResizeObservation: --set 'wrappers=[{{name: "
                f"gymnasium.wrappers:ResizeObservation, shape: [{smallest}, {smallest}]}}]'. Or"
            )
        else:
            continue
        joint = "" if problem.endswith("Or") else ";"
        raise IncompatibleSpaceError(
            owner, space, f"cannot learn from these observations: {problem}{joint} {FLATTEN_HINT}."
        )
