"""The observed velocity of the tool is its motion since the term was last read, and a reset does not begin it again."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from frobs_core.contracts import Control, Simulation
from frobs_core.description import ObservationTerm
from frobs_core.util.arrays import Floats
from templates.my_reach import MyReach


class Faulty(MyReach):
    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        super().bind(simulation, control, control_timestep)
        self._period = control_timestep
        self._seen: Floats = self._robot.frame_pose("tcp")[0].copy()

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        def velocity() -> Floats:
            moved = self._tcp - self._seen
            self._seen = self._tcp.copy()
            return moved / self._period

        fastest = np.full(3, 100.0)
        term = ObservationTerm(read=velocity, low=-fastest, high=fastest, unit="m/s")
        return {**super().observation_terms(), "tcp_velocity": term}
