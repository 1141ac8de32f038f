"""A reset measures nothing, so the first observation and the first progress belong to the last episode's goal."""

from __future__ import annotations

import numpy as np

from frobs_core.util.rotations import quat_from_axis_angle
from templates.my_drive import MyDrive


class Faulty(MyDrive):
    def reset(self, mask, rng, options):
        rows = slice(None) if mask is None else mask
        heading = rng.uniform("heading", -np.pi, np.pi, mask=mask)
        turned = quat_from_axis_angle(np.array([0.0, 0.0, 1.0]), heading)
        self._robot.write_base_pose(self._start[0][rows], turned, mask)
        if "goal" in options:
            self._goal[rows, :2] = options["goal"][rows, :2]
            return
        direction = rng.uniform("direction", -np.pi, np.pi, mask=mask)
        distance = rng.uniform("distance", *self.goal_distance, mask=mask)
        offset = distance[:, None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
        self._goal[rows, :2] = self._start[0][rows, :2] + offset
