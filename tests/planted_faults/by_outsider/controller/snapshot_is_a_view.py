"""The snapshot is the very arrays that the next actions are written into."""

from __future__ import annotations

import numpy as np

from templates.my_controller import MyController


class Faulty(MyController):
    def apply(self, action):
        self._smooth *= self.smoothing
        self._smooth += (1.0 - self.smoothing) * np.clip(action, -1.0, 1.0)
        self._target += self._step * self._smooth
        return np.clip(self._target, self._lower, self._upper, out=self._target)

    def snapshot(self):
        return {"target": self._target, "smooth": self._smooth}

    def restore(self, snapshot):
        self._target[:], self._smooth[:] = snapshot["target"], snapshot["smooth"]
