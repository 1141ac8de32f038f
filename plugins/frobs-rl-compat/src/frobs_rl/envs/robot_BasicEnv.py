"""The base class of environments, which answers as the package that inherits it expects."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.manner import Manner, answer_reset, answer_step
from frobs_rl_compat.named_imports import manner_by_imports
from frobs_ros.robot_basic_env import RobotBasicEnv as _RobotBasicEnv

__all__ = ["RobotBasicEnv"]


class RobotBasicEnv(_RobotBasicEnv):
    """A robot in Gazebo, as an environment: :class:`frobs_ros.robot_basic_env.RobotBasicEnv`.

    A class that inherits it in a file that imports ``gym`` has the answers of old gym: an observation from ``reset`` and
    four values from ``step``. In a file that imports ``gymnasium`` it has Gymnasium's.
    """

    _next_seed: int | None = None

    @property
    def frobs_manner(self) -> Manner:
        """In which manner this environment answers."""
        return manner_by_imports(type(self))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode: the observation, in Gymnasium's manner with the info behind it."""
        seed, self._next_seed = self._next_seed if seed is None else seed, None
        return answer_reset(self.frobs_manner, super().reset(seed=seed, options=options))

    def seed(self, seed: int | None = None) -> list[int]:
        """Seed the next ``reset``, as old gym did."""
        self._next_seed = seed
        return [] if seed is None else [seed]

    def step(self, action: Any) -> Any:
        """Act: observation, reward, done and info, in Gymnasium's manner with terminated and truncated for done."""
        return answer_step(self.frobs_manner, super().step(action))
