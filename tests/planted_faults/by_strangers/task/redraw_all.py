"""If one environment's goal is too near to the tool, the goals of all environments that begin an episode are drawn again."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import rows_of
from templates.my_reach import MyReach, distance_to


class Faulty(MyReach):
    def __init__(self, *, nearest=0.2, **parameters):
        super().__init__(**parameters)
        self.nearest = nearest

    def reset(self, mask, rng, options):
        super().reset(mask, rng, options)
        if "goal" in options:
            return
        rows = rows_of(mask)
        while np.any(distance_to(self._goal[rows], self._tcp[rows]) < self.nearest):
            self._goal[rows] = self._reachable[rng.integers("goal", 0, len(self._reachable), mask=mask)]
        self._measure()
