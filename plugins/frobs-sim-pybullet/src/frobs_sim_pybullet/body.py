"""The handle of a body in a PyBullet scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import BodyHandle
from frobs_core.description import Body
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import SimulationError

if TYPE_CHECKING:
    from frobs_sim_pybullet.simulation import PybulletSimulation


class PybulletBody(BodyHandle):
    """Handle of a scene body in all environments. See :class:`frobs_core.contracts.BodyHandle`.

    Attributes:
        moves: Whether the body is free or kinematic, and therefore not static.
    """

    def __init__(self, simulation: PybulletSimulation, name: str, body: Body) -> None:
        self.name = name
        self._simulation = simulation
        self.moves = body.kinematic or body.is_free
        self._is_free = body.is_free

    @property
    def pose(self) -> tuple[Floats, Floats]:
        pose = self._simulation.watched(f"bodies/{self.name}/pose")
        return pose[:, :3], pose[:, 3:]

    @property
    def twist(self) -> tuple[Floats, Floats]:
        twist = self._simulation.watched(f"bodies/{self.name}/twist")
        return twist[:, :3], twist[:, 3:]

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        if not self.moves:
            raise SimulationError(
                f"body '{self.name}' is static, so its pose cannot be set; make it kinematic or set a mass."
            )
        quats = None if quat_wxyz is None else np.expand_dims(quat_wxyz, -2)
        self._simulation.write_body_poses([self.name], np.expand_dims(pos, -2), quats, mask)

    def write_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        if not self._is_free:
            raise SimulationError(f"body '{self.name}' is not free, so its velocity cannot be set; set a mass.")
        n = self._simulation.count(mask)
        twist = np.concatenate([np.broadcast_to(part, (n, 3)) for part in (lin_vel_world, ang_vel_world)], axis=1)
        self._simulation.call("write_body_twist", mask, self.name, (twist, (6,)))
