"""Conversion of Gymnasium spaces to JSON, so that saved policies can be opened without an environment."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.preprocessing import is_image_space

from frobs_core.util.errors import FLATTEN_HINT, CheckpointError, IncompatibleSpaceError
from frobs_core.util.plain import read_numbers, spell_numbers


def space_to_json(space: gym.Space[Any]) -> dict[str, Any]:
    """Return a space as JSON, or raise IncompatibleSpaceError if the algorithms do not support its type."""
    dtype = None if space.dtype is None else np.dtype(space.dtype).name
    if isinstance(space, spaces.Box):
        low, high = spell_numbers(space.low.tolist()), spell_numbers(space.high.tolist())  # bounds may be infinite
        return {"type": "Box", "low": low, "high": high, "dtype": dtype}
    if isinstance(space, spaces.Discrete):
        return {"type": "Discrete", "n": int(space.n), "start": int(space.start), "dtype": dtype}
    if isinstance(space, spaces.MultiDiscrete):
        return {"type": "MultiDiscrete", "nvec": space.nvec.tolist(), "start": space.start.tolist(), "dtype": dtype}
    if isinstance(space, spaces.MultiBinary):
        return {"type": "MultiBinary", "n": space.n if isinstance(space.n, int) else list(space.n)}
    if isinstance(space, spaces.Dict):
        return {"type": "Dict", "spaces": {key: space_to_json(inner) for key, inner in space.spaces.items()}}
    raise IncompatibleSpaceError(
        "the algorithms of Stable-Baselines3",
        space,
        f"cannot learn from the space {space}; the supported spaces are Box, Discrete, MultiDiscrete, MultiBinary, and "
        "Dict of these.",
    )


_SMALLEST_IMAGE = 36
"""Smallest width and height of an image that the convolutions of stable-baselines3's NatureCNN can process [pixels]."""


def check_observation_space(owner: str, space: gym.Space[Any], convolutions: bool) -> None:
    """Check that the networks can process observations of a space.

    Args:
        owner: Name of the algorithm for the error message.
        space: The observation space.
        convolutions: Whether the networks process images with stable-baselines3's convolutions.

    Raises:
        IncompatibleSpaceError: The space contains nested dictionaries, numbers without an axis, or small images.
    """
    if isinstance(space, spaces.Tuple):
        raise IncompatibleSpaceError(
            owner, space, f"cannot learn from observations that are tuples ({space}); {FLATTEN_HINT}."
        )
    parts = space.spaces if isinstance(space, spaces.Dict) else {"": space}
    for key, part in parts.items():
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


def space_from_json(data: dict[str, Any]) -> gym.Space[Any]:
    """Convert the output of :func:`space_to_json` back to a space, or raise CheckpointError."""
    try:
        kind = data["type"]
        dtype: Any = np.dtype(data["dtype"]) if data.get("dtype") else None
        if kind == "Box":
            low, high = (np.array(read_numbers(data[key]), dtype) for key in ("low", "high"))
            return spaces.Box(low, high, dtype=dtype.type)
        if kind == "Discrete":
            return spaces.Discrete(data["n"], start=data["start"], dtype=dtype.type)
        if kind == "MultiDiscrete":
            return spaces.MultiDiscrete(data["nvec"], dtype=dtype.type, start=data["start"])
        if kind == "MultiBinary":
            return spaces.MultiBinary(data["n"])
        if kind == "Dict":
            return spaces.Dict({key: space_from_json(inner) for key, inner in data["spaces"].items()})
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise CheckpointError(f"a saved space is damaged: {error}.") from error
    raise CheckpointError(f"a saved space has the unknown type '{kind}'.")


def suggested_scale(env: gym.vector.VectorEnv[Any, Any, Any]) -> list[float] | None:
    """Return the scale factors that the observation terms suggest for a flat observation, or None."""
    scale = getattr(getattr(env.unwrapped, "observations", None), "scale", None)
    if scale is None or np.shape(scale) != env.single_observation_space.shape:
        return None
    return [float(factor) for factor in scale]
