"""The goal in the robot's frame is turned by the robot's heading instead of back by it."""

from __future__ import annotations

import numpy as np

from frobs_core.util.rotations import quat_rotate
from templates.my_drive import MyDrive


class Faulty(MyDrive):
    def _measure(self) -> None:
        pos, quat = self._robot.base_pose
        way = self._goal - pos
        way[:, 2] = 0.0
        self._way = quat_rotate(quat, way)
        self.distance = np.sqrt((way**2).sum(axis=-1))
