"""A body that is teleported keeps the velocity that it had before."""

from __future__ import annotations

from frobs_core.util.arrays import rows_of
from frobs_core.util.errors import SimulationError
from templates.my_simulator import FreeBody, MySimulator

EXACT, APPROXIMATE = "determinism snapshot teleport pause batched", "drive"


class _Body(FreeBody):
    def write_pose(self, pos, quat_wxyz=None, mask=None):
        if not self._moves:
            raise SimulationError(f"body '{self.name}' is static and cannot be moved; set a mass or kinematic=True.")
        self.pos[rows_of(mask)] = pos
        if quat_wxyz is not None:
            self.quat[rows_of(mask)] = quat_wxyz


class Faulty(MySimulator):
    def __init__(self, robots, scene, **options):
        super().__init__(robots, scene, **options)
        for body in self._bodies.values():
            body.__class__ = _Body
