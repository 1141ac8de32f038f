"""The action is clipped after the smoothing instead of before it, so an action outside the space also pushes the following steps."""

from __future__ import annotations

import numpy as np

from templates.my_controller import MyController


class Faulty(MyController):
    def apply(self, action):
        self._smooth = self.smoothing * self._smooth + (1.0 - self.smoothing) * action
        motion = self._step * np.clip(self._smooth, -1.0, 1.0)
        self._target = np.clip(self._target + motion, self._lower, self._upper)
        return self._target
