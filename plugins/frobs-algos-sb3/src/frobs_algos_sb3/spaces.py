"""Check of the observations that the networks of stable-baselines3 can process."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.preprocessing import is_image_space

from frobs_algos.spaces import subspaces
from frobs_core.util.errors import FLATTEN_HINT, IncompatibleSpaceError

_SMALLEST_IMAGE = 36
"""Smallest width and height of an image that the convolutions of stable-baselines3's NatureCNN can process [pixels]."""


def check_observation_space(owner: str, space: gym.Space[Any], convolutions: bool) -> None:
    """Check that the networks can process observations of a space.

    Args:
        owner: Name of the algorithm for the error message.
        space: The observation space.
        convolutions: Whether the networks process images with stable-baselines3's convolutions.
    """
    if isinstance(space, spaces.Tuple):
        raise IncompatibleSpaceError(
            owner, space, f"cannot learn from observations that are tuples ({space}); {FLATTEN_HINT}."
        )
    for key, part in subspaces(space).items():
        name = f"the observation '{key}'" if key else "the observation"
        if isinstance(part, spaces.Dict | spaces.Tuple):
            problem = f"{name} is a {type(part).__name__} inside a Dict, which the networks do not support"
        elif part.shape == () and isinstance(part, spaces.Box):
            problem = f"{name} is a number of shape (), but the networks need an array"
        elif convolutions and is_image_space(part) and min(np.sort(part.shape or ())[-2:]) < _SMALLEST_IMAGE:
            problem = (
                f"{name} is an image of shape {part.shape}, but the convolutions need at least {_SMALLEST_IMAGE} × "
                f"{_SMALLEST_IMAGE} pixels. Enlarge the image with the wrapper ResizeObservation: --set 'wrappers=[{{name: "
                f"gymnasium.wrappers:ResizeObservation, shape: [{_SMALLEST_IMAGE}, {_SMALLEST_IMAGE}]}}]'. Or"
            )
        else:
            continue
        joint = "" if problem.endswith("Or") else ";"
        raise IncompatibleSpaceError(
            owner, space, f"cannot learn from these observations: {problem}{joint} {FLATTEN_HINT}."
        )
