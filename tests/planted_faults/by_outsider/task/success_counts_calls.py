"""Success shall need three steps at the goal, but each call of ``is_success`` counts as one, and there are several."""

from __future__ import annotations

import numpy as np

from templates.my_drive import MyDrive


class Faulty(MyDrive):
    def bind(self, simulation, control, control_timestep):
        super().bind(simulation, control, control_timestep)
        self._held = np.zeros(simulation.num_envs, np.int64)

    def reset(self, mask, rng, options):
        self._held[slice(None) if mask is None else mask] = 0
        super().reset(mask, rng, options)

    def is_success(self):
        self._held = np.where(self.distance <= self.tolerance, self._held + 1, 0)
        return self._held >= 3

    def snapshot(self):
        return {**super().snapshot(), "held": self._held.copy()}

    def restore(self, snapshot):
        super().restore(snapshot)
        self._held = snapshot["held"].copy()
