"""Reads and writes physical parameters that differ between environments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import Snapshot
from frobs_core.util.arrays import Mask
from frobs_models import WrittenParameters

if TYPE_CHECKING:
    from frobs_sim_pybullet.simulation import PybulletSimulation


class PybulletParameters(WrittenParameters):
    """The parameters of a PyBullet simulation."""

    names = (*WrittenParameters.names, "size")

    def __init__(self, simulation: PybulletSimulation) -> None:
        super().__init__(simulation.placements, simulation.scene, simulation.robots, simulation.num_envs)
        self._simulation = simulation

    def apply(self, name: str, target: str, mask: Mask | None) -> None:
        """Pass a parameter's values to the worlds selected by ``mask``."""
        rows = slice(None) if mask is None else np.flatnonzero(mask)
        self._simulation.call("write_parameter", mask, name, target, self.written[name, target][rows])

    def sizes(self, env: int) -> dict[str, float]:
        """Return the size factors that were set in an environment, by body."""
        return {target: float(values[env]) for (name, target), values in self.written.items() if name == "size"}

    def restore(self, state: Snapshot) -> None:
        """Restore a snapshot."""
        super().restore(state)
        for robot in self._simulation.robots.values():
            robot.apply_gains()
