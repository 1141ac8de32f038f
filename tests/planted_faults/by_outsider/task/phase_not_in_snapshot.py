"""The goal circles, and where it is on its circle is not part of the snapshot."""

from __future__ import annotations

import numpy as np

from templates.my_reach import MyReach


class Faulty(MyReach):
    def bind(self, simulation, control, control_timestep):
        super().bind(simulation, control, control_timestep)
        self._angular_step = 0.5 * control_timestep  # [rad]
        self._phase = np.zeros(simulation.num_envs)
        self._center = np.zeros((simulation.num_envs, 3))

    def reset(self, mask, rng, options):
        super().reset(mask, rng, options)
        rows = slice(None) if mask is None else mask
        self._phase[rows] = 0.0
        self._center[rows] = self._goal[rows]

    def advance(self, context):
        self._phase += self._angular_step
        circle = 0.05 * np.stack([np.cos(self._phase) - 1.0, np.sin(self._phase), 0.0 * self._phase], axis=-1)
        self._goal[:] = self._center + circle
        super().advance(context)

    def snapshot(self):
        return {**super().snapshot(), "center": self._center.copy()}

    def restore(self, snapshot):
        self._center[:] = snapshot["center"]
        super().restore(snapshot)
