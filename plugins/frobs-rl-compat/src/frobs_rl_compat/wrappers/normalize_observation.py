"""Normalizes observations to [−1, 1] for any environment with a bounded Box observation space."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import RecordConstructorArgs

from frobs_rl_compat.wrappers.bounds import finite_bounds


class NormalizeObservationWrapper(
    gym.ObservationWrapper[npt.NDArray[np.float32], Any, npt.NDArray[Any]], RecordConstructorArgs
):
    """Wrapper that scales observations from the environment's bounds to [−1, 1]. Components with low = high become 0.

    Args:
        env: The environment to wrap. The observation space of the wrapped environment itself remains unchanged.
        clip: Whether to clip observations outside the environment's bounds to [−1, 1].

    Raises:
        ConfigurationError: The observation space is not a Box or has an unbounded component.
    """

    def __init__(self, env: gym.Env[npt.NDArray[Any], Any], clip: bool = False) -> None:
        RecordConstructorArgs.__init__(self, clip=clip)
        super().__init__(env)
        self.clip = clip
        low, high = finite_bounds(type(self).__name__, "observation", env.observation_space)
        self._middle = 0.5 * low + 0.5 * high
        half_range = 0.5 * high - 0.5 * low  # halved first, because high − low may overflow
        self._has_range = half_range > 0.0
        self._divisor = np.where(self._has_range, half_range, 1.0)
        self.observation_space = gym.spaces.Box(-1.0, 1.0, low.shape, np.float32)

    def observation(self, observation: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
        """Return the scaled observation."""
        return self.scale_observation(observation)

    def scale_observation(self, observation: npt.ArrayLike) -> npt.NDArray[np.float32]:
        """Scale an observation from [low, high] to [−1, 1].

        Args:
            observation: Array with the shape of the observation space.

        Returns:
            Array of the same shape, float32.

        Raises:
            ValueError: The shape is wrong.
        """
        values = np.asarray(observation, dtype=np.float64)
        if values.shape != self._middle.shape:
            raise ValueError(
                f"{type(self).__name__}: the observation must have the shape {self._middle.shape}, but it has "
                f"{values.shape}."
            )
        scaled = np.where(self._has_range, (values - self._middle) / self._divisor, 0.0)
        if self.clip:
            scaled = np.clip(scaled, -1.0, 1.0)
        return scaled.astype(np.float32)
