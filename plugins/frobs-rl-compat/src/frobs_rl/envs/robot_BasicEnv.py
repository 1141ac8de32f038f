"""Base class for Gazebo robot environments with the old gym API."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.gym_api import to_four_values
from frobs_rl_compat.old_gym.registration import is_made_by_gymnasium
from frobs_rl_compat.ros.robot_basic_env import RobotBasicEnv as _RobotBasicEnv

__all__ = ["RobotBasicEnv"]


class RobotBasicEnv(_RobotBasicEnv):
    """Version of :class:`frobs_rl_compat.ros.robot_basic_env.RobotBasicEnv` with the old gym API.

    ``reset`` returns only the observation, and ``step`` returns four values. Environments created by ``gymnasium.make``
    use the Gymnasium API instead, because ``gymnasium.make`` requires that API.
    """

    _next_seed: int | None = None

    @property
    def has_gym_api(self) -> bool:
        """Whether ``step`` returns four values."""
        return not is_made_by_gymnasium(self)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode and return the observation."""
        seed, self._next_seed = self._next_seed if seed is None else seed, None
        observation, info = super().reset(seed=seed, options=options)
        return observation if self.has_gym_api else (observation, info)

    def seed(self, seed: int | None = None) -> list[int]:
        """Seed the next ``reset``."""
        self._next_seed = seed
        return [] if seed is None else [seed]

    def step(self, action: Any) -> Any:
        """Execute an action and return ``(observation, reward, done, info)``."""
        answer = super().step(action)
        return to_four_values(answer) if self.has_gym_api else answer
