"""The last distance is the same array as the current one, so that the reward for progress is always 0."""

from __future__ import annotations

import numpy as np

from templates.my_drive import MyDrive, in_frame


class Faulty(MyDrive):
    def _measure(self) -> None:
        pos, quat = self._robot.base_pose
        np.subtract(self._goal, pos, out=self._way)
        self._way[:, 2] = 0.0
        np.sqrt((self._way**2).sum(axis=-1), out=self.distance)
        self._way[:] = in_frame(quat, self._way)
