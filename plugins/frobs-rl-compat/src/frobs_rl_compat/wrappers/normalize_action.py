"""Normalizes actions to [−1, 1] for any environment with a bounded Box action space."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import RecordConstructorArgs

from frobs_core.util.errors import InvalidActionError
from frobs_rl_compat.wrappers.bounds import finite_bounds


class NormalizeActionWrapper(gym.ActionWrapper[Any, npt.NDArray[Any], npt.NDArray[Any]], RecordConstructorArgs):
    """Wrapper that accepts actions in [−1, 1] and rescales them to the bounds of the environment's action space.

    Args:
        env: The environment to wrap. The action space of the wrapped environment itself remains unchanged.
        clip: Whether to clip actions to [−1, 1]. If False, actions outside [−1, 1] are rescaled without clipping.

    Raises:
        ConfigurationError: The action space is not a Box or has an unbounded component.
    """

    def __init__(self, env: gym.Env[Any, npt.NDArray[Any]], clip: bool = False) -> None:
        RecordConstructorArgs.__init__(self, clip=clip)
        super().__init__(env)
        self.clip = clip
        low, high = finite_bounds(type(self).__name__, "action", env.action_space)
        self._middle = 0.5 * low + 0.5 * high
        self._half_range = 0.5 * high - 0.5 * low  # halved first, because high − low may overflow
        self._dtype = env.action_space.dtype
        self.action_space = gym.spaces.Box(-1.0, 1.0, self._middle.shape, np.float32)

    def action(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the rescaled action for the wrapped environment."""
        return self.rescale_action(action)

    def rescale_action(self, scaled_action: npt.ArrayLike) -> npt.NDArray[Any]:
        """Rescale an action from [−1, 1] to [low, high]: low + 0.5 · (a + 1) · (high − low).

        Args:
            scaled_action: Array with the shape of the action space.

        Returns:
            Array of the same shape, with the dtype of the environment's action space.

        Raises:
            InvalidActionError: The shape is wrong.
        """
        scaled = np.asarray(scaled_action, dtype=np.float64)
        if scaled.shape != self._middle.shape:
            raise InvalidActionError(
                f"{type(self).__name__}: the action must have the shape {self._middle.shape}, but it has "
                f"{scaled.shape}."
            )
        if self.clip:
            scaled = np.clip(scaled, -1.0, 1.0)
        return (self._middle + scaled * self._half_range).astype(self._dtype)
