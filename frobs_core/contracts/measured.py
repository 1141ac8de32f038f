"""Handles of real robots and bodies, whose state is measured from time to time."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts.body_handle import BodyHandle
from frobs_core.contracts.robot_handle import RobotHandle
from frobs_core.models.model import Pose
from frobs_core.util.arrays import Floats, read_only


class MeasuredRobot(RobotHandle):
    """Handle of a robot with the joint state that was measured last.

    Attributes:
        measured: Joint positions [rad or m], velocities [rad/s or m/s] and efforts [N·m or N], (3, 1, dof).
    """

    measured: Floats

    @property
    def joint_positions(self) -> Floats:
        """(1, dof) [rad or m]."""
        return read_only(self.measured[0])

    @property
    def joint_velocities(self) -> Floats:
        """(1, dof) [rad/s or m/s]."""
        return read_only(self.measured[1])

    @property
    def joint_efforts(self) -> Floats:
        """(1, dof) [N·m or N]."""
        return read_only(self.measured[2])


class MeasuredBody(BodyHandle):
    """Handle of a body with the pose that was measured last.

    Args:
        name: Name in the scene.
        pose: Pose before the first measurement.
    """

    def __init__(self, name: str, pose: Pose) -> None:
        self.name = name
        self.measure(np.array(pose.pos), np.array(pose.quat_wxyz))

    def measure(self, pos: Floats, quat_wxyz: Floats) -> None:
        """Set the pose in the world frame.

        Args:
            pos: (3,) [m]
            quat_wxyz: (4,)
        """
        self._pose = pos.reshape(1, 3), quat_wxyz.reshape(1, 4)

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """pos (1, 3) [m] and quat_wxyz (1, 4) in the world frame."""
        pos, quat = self._pose
        return read_only(pos), read_only(quat)

    @property
    def twist(self) -> tuple[Floats, Floats]:
        """Zeros, because a pose does not report velocities: (1, 3) [m/s] and (1, 3) [rad/s]."""
        return np.zeros((1, 3)), np.zeros((1, 3))
