"""The tool's velocity is its change divided by the class's default time between actions, not by the one in force."""

from __future__ import annotations

import numpy as np

from frobs_core.description import ObservationTerm
from templates.my_reach import MyReach


class Faulty(MyReach):
    def bind(self, simulation, control, control_timestep):
        super().bind(simulation, control, control_timestep)
        self._velocity = np.zeros((simulation.num_envs, 3))

    def reset(self, mask, rng, options):
        super().reset(mask, rng, options)
        self._velocity[slice(None) if mask is None else mask] = 0.0

    def advance(self, context):
        before = self._tcp
        super().advance(context)
        self._velocity = (self._tcp - before) / self.control_timestep

    def observation_terms(self):
        bound = np.full(3, 100.0)
        velocity = ObservationTerm(read=lambda: self._velocity, low=-bound, high=bound, unit="m/s")
        return {**super().observation_terms(), "tcp_velocity": velocity}

    def snapshot(self):
        return {**super().snapshot(), "velocity": self._velocity.copy()}

    def restore(self, snapshot):
        super().restore(snapshot)
        self._velocity = snapshot["velocity"].copy()
