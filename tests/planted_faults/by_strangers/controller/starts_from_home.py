"""An episode's commands start from the home positions, wherever the task has placed the robot."""

from __future__ import annotations

from frobs_controllers.joint_delta_position import JointDeltaPosition
from frobs_core.util.arrays import Mask, rows_of


class Faulty(JointDeltaPosition):
    def reset(self, mask: Mask | None) -> None:
        rows = rows_of(mask)
        self._target[rows] = self._joints.home[rows]
