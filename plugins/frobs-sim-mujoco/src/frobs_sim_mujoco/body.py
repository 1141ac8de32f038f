"""One body of a MuJoCo scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import SimulationError
from frobs_core.interfaces import Body, BodyHandle

if TYPE_CHECKING:
    from frobs_sim_mujoco.simulation import MujocoSimulation


class MujocoBody(BodyHandle):
    """One body, in every environment; see :class:`frobs_core.interfaces.BodyHandle`.

    Attributes:
        mocap: MuJoCo's number of it among those that move only where they are written to; −1: it is none of them.
    """

    def __init__(self, simulation: MujocoSimulation, name: str, body: Body) -> None:
        self.name = name
        self._simulation = simulation
        self._id = simulation.model.body(name).id
        self.mocap = int(simulation.model.body_mocapid[self._id])
        self._free = simulation.model.joint(name) if body.mass is not None else None

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4) in the world."""
        return self._simulation.derived("xpos")[:, self._id], self._simulation.derived("xquat")[:, self._id]

    @property
    def twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (num_envs, 3) [m/s] and ang_vel_world (num_envs, 3) [rad/s]."""
        twist = self._simulation.derived("cvel")[:, self._id]  # a lone body: about its own centre
        return twist[:, 3:], twist[:, :3]

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        """Put the body somewhere at once."""
        batch = self._simulation.batch
        rows = slice(None) if mask is None else np.flatnonzero(mask)
        if self.mocap >= 0:
            batch.bind("mocap_pos")[rows, self.mocap] = pos
            if quat_wxyz is not None:
                batch.bind("mocap_quat")[rows, self.mocap] = quat_wxyz
        elif self._free is not None:
            at, dof = self._free.qposadr[0], self._free.dofadr[0]
            batch.bind("qpos")[rows, at : at + 3] = pos
            if quat_wxyz is not None:
                batch.bind("qpos")[rows, at + 3 : at + 7] = quat_wxyz
            batch.bind("qvel")[rows, dof : dof + 6] = 0.0
        else:
            raise SimulationError(f"body '{self.name}' is static; make it kinematic, or give it a mass.")
        self._simulation.mark_stale(mask)
