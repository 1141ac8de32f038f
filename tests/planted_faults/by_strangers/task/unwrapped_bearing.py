"""The angle by which the robot has to turn is the difference of two headings and is not wrapped, so it can be more than half a turn, in the observation and in the reward."""

from __future__ import annotations

import numpy as np

from frobs_core.description import ObservationTerm
from templates.my_drive import MyDrive


class Faulty(MyDrive):
    def __init__(self, *, turn_weight=0.05, **parameters):
        super().__init__(**parameters)
        self.turn_weight = turn_weight

    def _measure(self):
        super()._measure()
        pos, quat = self._robot.base_pose
        w, x, y, z = quat.T
        heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y**2 + z**2))
        self._turn = np.arctan2(*(self._goal - pos)[:, 1::-1].T) - heading

    def observation_terms(self):
        half = np.full(1, 2.0 * np.pi)
        turn = ObservationTerm(read=lambda: self._turn[:, None], low=-half, high=half, unit="rad")
        return {**super().observation_terms(), "turn": turn}

    def reward(self, context):
        reward = super().reward(context)
        if self.reward_type != "dense":
            return reward
        self._reward_terms["turn"] = -self.turn_weight * np.abs(self._turn)
        return np.asarray(sum(self._reward_terms.values()))
