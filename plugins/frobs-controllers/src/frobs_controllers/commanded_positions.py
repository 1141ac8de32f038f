"""Base class for controllers whose actions change the commanded joint positions."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller, JointGroup, Snapshot
from frobs_core.util.arrays import Floats, Mask, rows_of


class CommandedPositions(Controller):
    """Controller that stores commanded joint positions and initializes them with the actual positions."""

    command_mode = CommandMode.POSITION
    _target: Floats  # (num_envs, dof) [rad or m]

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints."""
        self._joints = joints
        self._target = np.zeros((joints.num_envs, joints.dof))
        self.axes = joints.joint_names
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)
        self.reset(None)

    def reset(self, mask: Mask | None) -> None:
        """Set the commanded positions to the current joint positions."""
        self._target[rows_of(mask)] = self._joints.joint_positions[rows_of(mask)]

    def stored_arrays(self) -> Snapshot:
        """Return the commanded joint positions."""
        return {"target": self._target}
