"""Actions are joint positions, scaled to the limits."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_controllers.parameters import position_range
from frobs_core.arrays import Action, Floats, Mask
from frobs_core.interfaces import CommandMode, Controller, RobotHandle


class JointPosition(Controller):
    """Commands the joint positions that an action names: −1 is the lower limit, 1 the upper, 0 the middle.

    A joint without limits turns in [−π, π].
    """

    command_mode = CommandMode.POSITION

    def bind(self, robot: RobotHandle, control_timestep: float, decimation: int) -> None:
        """Prepare for a robot.

        Raises:
            ConfigurationError: A prismatic joint has no limits.
        """
        self._lower, self._upper = position_range("joint_position", robot)
        self._middle = 0.5 * (self._lower + self._upper)
        self._half_range = 0.5 * (self._upper - self._lower)
        self._target = np.zeros((robot.num_envs, robot.dof))
        self.action_space = gym.spaces.Box(-1.0, 1.0, (robot.dof,), np.float32)

    def reset(self, mask: Mask | None) -> None:
        """Do nothing: an action names the whole target."""

    def apply(self, action: Action) -> Floats:
        """Return the joint positions that the action names, (num_envs, dof) [rad or m]."""
        target = self._target
        np.multiply(action, self._half_range, out=target)
        np.add(target, self._middle, out=target)
        np.maximum(target, self._lower, out=target)  # bounds the action too, and rounding
        np.minimum(target, self._upper, out=target)
        return target
