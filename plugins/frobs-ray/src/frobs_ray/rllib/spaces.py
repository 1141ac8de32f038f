"""Conversion of observations to flat float arrays, and of network outputs to the environment's actions."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from frobs_algos.spaces import flatten, subspaces
from frobs_core.description import Observation
from frobs_core.util.arrays import Action
from frobs_core.util.errors import FLATTEN_HINT, IncompatibleSpaceError

Floats32 = np.ndarray[Any, np.dtype[np.float32]]


class FlatSpaces:
    """Converts batches of observations and actions between an environment and the networks.

    Args:
        observation: Observation space of one environment, which must be a Box of numbers or a Dict of such boxes.
        action: Action space of one environment, which must be a bounded Box or Discrete.
        algorithm: Name of the algorithm, for error messages.

    Attributes:
        observation: Observation space of the networks, which is a flat Box of float32.
        action: Action space of the networks, which is a flat Box in [−1, 1], or Discrete starting at 0.

    Raises:
        IncompatibleSpaceError: The type of a space is not supported.
    """

    def __init__(self, observation: gym.Space[Any], action: gym.Space[Any], algorithm: str) -> None:
        parts = subspaces(observation).values()
        if not all(isinstance(part, spaces.Box) and len(part.shape) < 3 for part in parts):
            raise IncompatibleSpaceError(
                f"algorithm '{algorithm}'",
                observation,
                f"needs numeric observations, flat or in a Dict, but the observation space is {observation}; "
                f"{FLATTEN_HINT}, or use an algorithm of frobs-algos-sb3 for images and discrete values.",
            )
        self._space = observation
        size = sum(int(np.prod(part.shape)) for part in parts if part.shape is not None)
        self.observation = spaces.Box(-np.inf, np.inf, (size,), np.float32)
        if isinstance(action, spaces.Discrete):
            self.action: gym.Space[Any] = spaces.Discrete(int(action.n))
            self._start = int(action.start)
            return
        if not isinstance(action, spaces.Box) or not action.is_bounded():
            raise IncompatibleSpaceError(
                f"algorithm '{algorithm}'",
                action,
                f"needs actions with finite bounds, but the action space is {action}; "
                "give the action_space of the environment finite bounds, or choose another controller.",
            )
        self._low, self._high = action.low.astype(np.float32), action.high.astype(np.float32)
        self.action = spaces.Box(-1.0, 1.0, (int(np.prod(action.shape)),), np.float32)

    def flatten(self, observation: Observation) -> Floats32:
        """Return a batch of observations as a newly allocated float32 array (batch, k)."""
        return flatten(observation, self._space)

    def flatten_one(self, observation: Any) -> Floats32:
        """Return a single observation as a float32 array (k,)."""
        is_dict = isinstance(observation, dict)
        batch = {key: part[None] for key, part in observation.items()} if is_dict else np.asarray(observation)[None]
        return self.flatten(batch).ravel()

    def to_env(self, action: np.ndarray[Any, Any]) -> Action:
        """Convert the networks' actions (batch, n) or (batch,) to environment actions, clipped to their bounds."""
        if isinstance(self.action, spaces.Discrete):
            return action + self._start
        unit = action.reshape(-1, *self._low.shape)
        scaled = self._low + 0.5 * (unit + 1.0) * (self._high - self._low)
        return np.clip(scaled, self._low, self._high)
