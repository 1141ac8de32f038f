"""Actions move the commanded joint positions by up to a step."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_controllers.parameters import flag, position_range, positive, rows
from frobs_core.arrays import Action, Floats, Mask
from frobs_core.interfaces import CommandMode, Controller, RobotHandle, Snapshot


class JointDeltaPosition(Controller):
    """Moves the commanded joint positions by an action in [−1, 1], times a step.

    Steps add up on the *commanded* positions, not on the measured ones: gravity lets the joints hang a little
    below what is commanded, and an arm that starts each step from there would sink.

    Args:
        max_delta: Step of an action of 1 [rad or m].
        full_range: As FRobs_RL does it: the action space is the joint limits themselves, not normalised, and an
            action is added to the *measured* positions. ``max_delta`` then means nothing.
    """

    command_mode = CommandMode.POSITION

    def __init__(self, *, max_delta: float = 0.15, full_range: bool = False) -> None:
        self.max_delta = positive("joint_delta_position", "max_delta", max_delta, "rad or m")
        self.full_range = flag("joint_delta_position", "full_range", full_range)

    def bind(self, robot: RobotHandle, control_timestep: float, decimation: int) -> None:
        """Prepare for a robot.

        Raises:
            ConfigurationError: ``full_range``, and a prismatic joint has no limits.
        """
        self._robot = robot
        shape = (robot.num_envs, robot.dof)
        if self.full_range:
            self._lower, self._upper = position_range("joint_delta_position", robot)
            low, high = self._lower[0].astype(np.float32), self._upper[0].astype(np.float32)
            self._low, self._high, self._scale = self._lower, self._upper, np.ones(shape)
        else:
            self._lower, self._upper = robot.position_lower.copy(), robot.position_upper.copy()
            low, high = np.full(robot.dof, -1.0, np.float32), np.full(robot.dof, 1.0, np.float32)
            self._low, self._high, self._scale = -np.ones(shape), np.ones(shape), np.full(shape, self.max_delta)
        self._delta, self._target = np.zeros(shape), np.zeros(shape)
        self.action_space = gym.spaces.Box(low, high, dtype=np.float32)
        self.reset(None)

    def reset(self, mask: Mask | None) -> None:
        """Command the present positions."""
        self._target[rows(mask)] = self._robot.joint_positions[rows(mask)]

    def apply(self, action: Action) -> Floats:
        """Return the joint positions to go to, (num_envs, dof) [rad or m], inside the limits."""
        delta, target = self._delta, self._target
        np.maximum(action, self._low, out=delta)
        np.minimum(delta, self._high, out=delta)
        np.multiply(delta, self._scale, out=delta)
        np.add(self._robot.joint_positions if self.full_range else target, delta, out=target)
        np.maximum(target, self._lower, out=target)
        np.minimum(target, self._upper, out=target)
        return target

    def snapshot(self) -> Snapshot:
        """Return the commanded positions."""
        return {"target": self._target.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._target[:] = snapshot["target"]
