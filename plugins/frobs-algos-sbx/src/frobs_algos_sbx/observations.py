"""Conversion of observations to flat float32 arrays, which sbx's networks require."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from frobs_algos.spaces import flatten, subspaces
from frobs_core.util.errors import FLATTEN_HINT, IncompatibleSpaceError


class FlatObservations(VecEnvWrapper):
    """Wrapper that joins the parts of an observation into one array and multiplies the array by constants.

    Args:
        venv: The environments.
        scale: Constant factors (k,), or None for no scaling.
    """

    def __init__(self, venv: VecEnv, scale: Sequence[float] | None) -> None:
        space = flat_space(venv.observation_space)
        self.scale = None if scale is None else np.asarray(scale, np.float32)
        super().__init__(venv, space)

    def reset(self) -> VecEnvObs:
        """Reset all environments and return flat observations."""
        return self.flatten(self.venv.reset())

    def step_wait(self) -> VecEnvStepReturn:
        """Return the step's results, with flat observations."""
        observation, rewards, dones, infos = self.venv.step_wait()
        for i in np.flatnonzero(dones):
            final = infos[i]["terminal_observation"]
            batch = {key: value[None] for key, value in final.items()} if isinstance(final, dict) else final[None]
            infos[i] = {**infos[i], "terminal_observation": self.flatten(batch)[0]}
        return self.flatten(observation), rewards, dones, infos

    def flatten(self, observation: Any) -> np.ndarray[Any, Any]:
        """Return a batch of observations as a float32 array (n, k)."""
        joined = flatten(observation, self.venv.observation_space)
        return joined if self.scale is None else joined * self.scale


def flat_space(space: gym.Space[Any]) -> spaces.Box:
    """Return the space of flat observations.

    Raises:
        IncompatibleSpaceError: A part of the space is an image, or is not an array of numbers.
    """
    size = 0
    for part in subspaces(space).values():
        if not isinstance(part, spaces.Box) or part.dtype == np.uint8:
            raise IncompatibleSpaceError(
                "the algorithms of sbx",
                space,
                f"do not support the observation space {space}; choose an algorithm of stable-baselines3, or "
                f"{FLATTEN_HINT}.",
            )
        size += int(np.prod(part.shape))
    return spaces.Box(-np.inf, np.inf, (size,), np.float32)
