"""Controller whose commands come from topics instead of actions."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller, JointGroup
from frobs_core.plugins.records import ControllerRecord
from frobs_core.util.arrays import Action, Floats, Mask

RECORD = ControllerRecord(
    name="ros2_topics",
    summary="commands from the topics of ROS 2",
    entry_point="frobs_ros2.serve.controller:ExternalCommands",
    install_hint="pip install frobs-ros2",
)


class ExternalCommands(Controller):
    """Controller that sends the rows in :attr:`rows` to the joints and ignores the action.

    Attributes:
        rows: Command of the next step, (1, dof) or (1, decimation, dof), in the units of the joints' command modes.
    """

    command_mode = CommandMode.POSITION

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints."""
        self.joints = joints
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)
        self.rows: Floats = joints.home.copy()

    def reset(self, mask: Mask | None) -> None:
        """Hold the current positions."""
        self.rows = self.joints.joint_positions.copy()

    def apply(self, action: Action) -> Floats:
        """Return the command of the next step. The action is ignored."""
        return self.rows
