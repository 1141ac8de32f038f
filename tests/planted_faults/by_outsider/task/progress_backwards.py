"""The sign of the progress is wrong: the reward grows as the robot drives away from the goal."""

from __future__ import annotations

import numpy as np

from templates.my_drive import MyDrive


class Faulty(MyDrive):
    def reward(self, context):
        super().reward(context)
        if "progress" in self._reward_terms:
            self._reward_terms["progress"] = self.progress_weight * (self.distance - self.last_distance)
        return np.asarray(sum(self._reward_terms.values()))
