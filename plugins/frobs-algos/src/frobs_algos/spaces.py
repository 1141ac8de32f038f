"""Spaces as JSON, so that saved policies can be opened without an environment, and flat observations."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

from frobs_core.description import Observation
from frobs_core.util.errors import CheckpointError, IncompatibleSpaceError
from frobs_core.util.plain import read_numbers, spell_numbers

__all__ = [
    "NoEnvironment",
    "flatten",
    "is_picture",
    "picture_bytes",
    "space_from_json",
    "space_to_json",
    "subspaces",
    "suggested_scale",
]


class NoEnvironment(gym.vector.VectorEnv[Any, Any, Any]):
    """Placeholder environment that provides only spaces, for policies that are used only for predictions."""

    def __init__(self, num_envs: int, observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> None:
        self.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}
        self.num_envs = num_envs
        self.single_observation_space = observation_space
        self.single_action_space = action_space


def subspaces(space: gym.Space[Any]) -> dict[str, gym.Space[Any]]:
    """Return the space of each part of an observation by key. A single array has the key ``""``."""
    return dict(space.spaces) if isinstance(space, spaces.Dict) else {"": space}


def is_picture(space: gym.Space[Any]) -> bool:
    """Return whether a space contains pictures, three-dimensional arrays of uint8."""
    return isinstance(space, spaces.Box) and space.dtype == np.uint8 and len(space.shape) == 3


def picture_bytes(space: gym.Space[Any]) -> int:
    """Return the number of bytes of the pictures in one observation."""
    return sum(int(np.prod(part.shape or ())) for part in subspaces(space).values() if is_picture(part))


def flatten(observation: Observation, space: gym.Space[Any]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Return a batch of observations as a new array (n, k) float32. Parts of a dictionary have the space's order."""
    parts: Any = [observation[key] for key in space.spaces] if isinstance(space, spaces.Dict) else [observation]
    return np.concatenate([np.reshape(part, (len(part), -1)) for part in parts], axis=1, dtype=np.float32)


def space_to_json(space: gym.Space[Any]) -> dict[str, Any]:
    """Return a space as JSON, or raise IncompatibleSpaceError if no algorithm supports its type."""
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
        "the algorithm",
        space,
        f"cannot learn from the space {space}; the supported spaces are Box, Discrete, MultiDiscrete, MultiBinary, and "
        "Dict of these.",
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
