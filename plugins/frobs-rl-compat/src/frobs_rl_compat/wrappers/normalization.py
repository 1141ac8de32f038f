"""Normalizes actions and observations to [−1, 1] for any environment whose space is a bounded Box."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import RecordConstructorArgs

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import IncompatibleSpaceError, InvalidActionError


class _Bounds:
    def __init__(self, wrapper: str, kind: str, space: gym.Space[Any]) -> None:
        if not isinstance(space, gym.spaces.Box):
            raise IncompatibleSpaceError(
                wrapper, space, f"requires a Box {kind} space, but this environment has {space}; remove the wrapper."
            )
        low, high = space.low.astype(np.float64), space.high.astype(np.float64)
        unbounded = np.argwhere(~(np.isfinite(low) & np.isfinite(high)))
        if len(unbounded):
            first = tuple(int(i) for i in unbounded[0])
            raise IncompatibleSpaceError(
                wrapper,
                space,
                f"requires finite bounds, but {len(unbounded)} of {low.size} {kind} components are unbounded, such "
                f"as component {first[0] if len(first) == 1 else first} with the range [{low[first]}, {high[first]}]; "
                f"set finite bounds first, for example with gymnasium.wrappers.Transform{kind.title()}.",
            )
        self._owner, self._kind = wrapper, kind
        self.middle = 0.5 * low + 0.5 * high
        self.half_range = 0.5 * high - 0.5 * low  # halved first, because high − low may overflow
        self.normalized = gym.spaces.Box(-1.0, 1.0, low.shape, np.float32)

    def checked(self, values: npt.ArrayLike, error: type[Exception]) -> Floats:
        """Return an action or observation as float64, or raise ``error`` if its shape is wrong."""
        array = np.asarray(values, dtype=np.float64)
        if array.shape != self.middle.shape:
            raise error(
                f"{self._owner}: the {self._kind} must have the shape {self.middle.shape}, but it has {array.shape}."
            )
        return array


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
        self._bounds = _Bounds(type(self).__name__, "action", env.action_space)
        self._dtype = env.action_space.dtype
        self.action_space = self._bounds.normalized

    def action(self, action: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the rescaled action for the wrapped environment.

        Args:
            action: Array with the shape of the action space.

        Returns:
            Array of the same shape, with the dtype of the environment's action space.
        """
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
        scaled = self._bounds.checked(scaled_action, InvalidActionError)
        if self.clip:
            scaled = np.clip(scaled, -1.0, 1.0)
        return (self._bounds.middle + scaled * self._bounds.half_range).astype(self._dtype)


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
        self._bounds = _Bounds(type(self).__name__, "observation", env.observation_space)
        self._has_range = self._bounds.half_range > 0.0
        self._divisor = np.where(self._has_range, self._bounds.half_range, 1.0)
        self.observation_space = self._bounds.normalized

    def observation(self, observation: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
        """Return the scaled observation.

        Args:
            observation: Array with the shape of the observation space.

        Returns:
            Array of the same shape, float32.
        """
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
        values = self._bounds.checked(observation, ValueError)
        scaled = np.where(self._has_range, (values - self._bounds.middle) / self._divisor, 0.0)
        if self.clip:
            scaled = np.clip(scaled, -1.0, 1.0)
        return scaled.astype(np.float32)
