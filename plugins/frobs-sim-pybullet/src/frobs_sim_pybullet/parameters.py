"""Reads and writes physical parameters that differ between environments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import Snapshot
from frobs_core.util.arrays import Floats, Mask
from frobs_models import WrittenParameters
from frobs_sim_pybullet.looks import Looks

if TYPE_CHECKING:
    from frobs_sim_pybullet.simulation import PybulletSimulation


class PybulletParameters(WrittenParameters):
    """The parameters of a PyBullet simulation."""

    names = (*WrittenParameters.names, "size", *Looks.names)

    def __init__(self, simulation: PybulletSimulation) -> None:
        super().__init__(simulation.placements, simulation.scene, simulation.robots, simulation.num_envs)
        self._simulation = simulation

    def apply(self, name: str, target: str, mask: Mask | None) -> None:
        rows = slice(None) if mask is None else np.flatnonzero(mask)
        self._simulation.call("write_parameter", mask, name, target, self.written[name, target][rows])

    def sizes(self, env: int) -> dict[str, float]:
        """Return the size factors that were set in an environment, by body."""
        return {target: float(values[env]) for (name, target), values in self.written.items() if name == "size"}

    def read(self, name: str, target: str) -> Floats:
        return self._simulation.looks.read(name, target) if name in Looks.names else super().read(name, target)

    def write(self, name: str, target: str, values: Floats, mask: Mask | None) -> None:
        if name in Looks.names:
            self._simulation.looks.write(name, target, np.asarray(values, np.float64), mask)
        else:
            super().write(name, target, values, mask)

    def snapshot(self) -> Snapshot:
        return super().snapshot() | self._simulation.looks.snapshot()

    def restore(self, state: Snapshot) -> None:
        super().restore(state)
        self._simulation.looks.restore(state)
        for robot in self._simulation.robots.values():
            robot.apply_gains()
