"""Step limit that reports whether an episode succeeded and whether it reached the limit."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from frobs_core.util.errors import ParameterValueError, ResetNeededError


class TimeLimitWrapper(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Wrapper that truncates an episode after a number of steps.

    The info of an episode's last step contains ``time_limit_reached`` (bool) and ``is_success`` (1.0 or 0.0).
    ``is_success`` is the environment's own value, even if the limit is reached at the same step, or 0.0 if the
    environment does not report success.

    Args:
        env: The environment.
        max_steps: Maximum number of steps per episode, ≥ 1.
        legacy: Whether to behave like FRobs_RL, in which the limit also sets ``terminated`` and therefore prevents
            agents from bootstrapping the value of the last state.

    Raises:
        ConfigurationError: ``max_steps`` is not a whole number ≥ 1.
    """

    def __init__(self, env: gym.Env[Any, Any], max_steps: int = 100, legacy: bool = False) -> None:
        RecordConstructorArgs.__init__(self, max_steps=max_steps, legacy=legacy)
        super().__init__(env)
        if isinstance(max_steps, bool) or not isinstance(max_steps, int | np.integer) or max_steps < 1:
            raise ParameterValueError("max_steps", max_steps, "a whole number of at least 1", type(self).__name__)
        self.max_steps = int(max_steps)
        self.legacy = legacy
        self._elapsed_steps: int | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode of at most ``max_steps`` steps."""
        self._elapsed_steps = 0
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Take a step, and truncate the episode at the limit.

        Raises:
            ResetNeededError: ``reset`` has not been called yet.
        """
        if self._elapsed_steps is None:
            raise ResetNeededError(f"{type(self).__name__}: call reset() before the first step().")
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._elapsed_steps += 1
        limit_reached = self._elapsed_steps >= self.max_steps
        if limit_reached:
            truncated = True
            terminated = terminated or self.legacy
        if terminated or truncated:
            info["time_limit_reached"] = limit_reached
            info.setdefault("is_success", 0.0)
        return observation, reward, terminated, truncated, info
