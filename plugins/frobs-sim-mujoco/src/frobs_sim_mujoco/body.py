"""The handle of a body in a MuJoCo scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from frobs_core.contracts import BodyHandle
from frobs_core.description import AT_REST, Body
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import SimulationError
from frobs_core.util.rotations import quat_conjugate, quat_rotate
from frobs_sim_mujoco.columns import numbers_of

if TYPE_CHECKING:
    from frobs_sim_mujoco.simulation import MujocoSimulation


class MujocoBody(BodyHandle):
    """Handle of a scene body in all environments. See :class:`frobs_core.contracts.BodyHandle`.

    Attributes:
        mocap: MuJoCo's mocap index of a kinematic body, or −1 if the body is not kinematic.
    """

    def __init__(self, simulation: MujocoSimulation, name: str, body: Body) -> None:
        self.name = name
        self._simulation = simulation
        self._id = simulation.model.body(name).id
        self.mocap = int(simulation.model.body_mocapid[self._id])
        self._free = simulation.model.joint(name) if body.is_free else None
        self._initial_twist = body.twist
        self._views: tuple[Floats, ...] = ()

    @property
    def pose(self) -> tuple[Floats, Floats]:
        pos, quat_wxyz, _, _ = self._views or self._bind()
        if self._simulation.stale is not None:
            self._simulation.refresh()
        return pos, quat_wxyz

    @property
    def twist(self) -> tuple[Floats, Floats]:
        _, _, lin_vel_world, ang_vel_world = self._views or self._bind()
        if self._simulation.stale is not None:
            self._simulation.refresh()
        return lin_vel_world, ang_vel_world

    def _bind(self) -> tuple[Floats, ...]:
        """Store views of the body's position, orientation, and linear and angular velocity."""
        derived = self._simulation.derived
        pos, quat_wxyz, twist = (derived(field)[:, self._id] for field in ("xpos", "xquat", "cvel"))
        linear = twist[:, 3:]  # at the center of mass, which is the origin of a body that is not free
        if self._free is not None:
            dof = self._free.dofadr[0]
            linear = read_only(self._simulation.states["qvel"][:, dof : dof + 3])
        self._views = pos, quat_wxyz, linear, twist[:, :3]
        return self._views

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        states = self._simulation.states
        rows = numbers_of(mask)
        if self.mocap >= 0:
            states["mocap_pos"][rows, self.mocap] = pos
            if quat_wxyz is not None:
                states["mocap_quat"][rows, self.mocap] = quat_wxyz
        elif self._free is not None:
            at, dof = self._free.qposadr[0], self._free.dofadr[0]
            states["qpos"][rows, at : at + 3] = pos
            if quat_wxyz is not None:
                states["qpos"][rows, at + 3 : at + 7] = quat_wxyz
            states["qvel"][rows, dof : dof + 6] = 0.0
        else:
            raise SimulationError(
                f"body '{self.name}' is static, so its pose cannot be set; make it kinematic or set a mass."
            )
        self._simulation.mark_stale(mask)

    def write_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        if self._free is None:
            raise SimulationError(f"body '{self.name}' is not free, so its velocity cannot be set; set a mass.")
        rows = numbers_of(mask)
        put_free_twist(self._simulation.states, self._free, rows, lin_vel_world, ang_vel_world)
        self._simulation.mark_stale(mask)

    def start(self) -> None:
        """Set the body's velocity to its initial velocity in the scene."""
        if self._initial_twist != AT_REST:
            self.write_twist(*map(np.array, self._initial_twist))


def put_free_twist(
    states: Mapping[str, Floats], joint: Any, rows: slice | np.ndarray, lin_vel_world: Floats, ang_vel_world: Floats
) -> None:
    """Set the linear [m/s] and angular [rad/s] velocities of a free body in the world frame, (n, 3) each."""
    dof, at = joint.dofadr[0], joint.qposadr[0]
    quat = quat_conjugate(states["qpos"][rows, at + 3 : at + 7])
    qvel = states["qvel"]
    qvel[rows, dof : dof + 3] = lin_vel_world
    # MuJoCo stores a free joint's angular velocity in the body's own frame.
    qvel[rows, dof + 3 : dof + 6] = quat_rotate(quat, np.broadcast_to(ang_vel_world, (len(quat), 3)))
