"""The reward for replayed goals is the sparse one, even if the task gives the dense reward."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_tasks_reach.goal import ReachGoal


class Faulty(ReachGoal):
    def compute_reward(self, achieved_goal: Floats, desired_goal: Floats, info: Any) -> Floats:
        offset = np.asarray(desired_goal, np.float64) - np.asarray(achieved_goal, np.float64)
        x, y, z = np.moveaxis(offset, -1, 0)
        return np.where(np.sqrt(x * x + y * y + z * z) <= self.tolerance, 0.0, -1.0)
