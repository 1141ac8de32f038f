"""The handle of a body in a Gazebo scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import BodyHandle
from frobs_core.description import Body
from frobs_core.models import pose_array
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import SimulationError
from frobs_core.util.rotations import quat_rotate

if TYPE_CHECKING:
    from frobs_sim_gazebo.simulation import GazeboSimulation

_NO_JOINTS = slice(0, 0)


class GazeboBody(BodyHandle):
    """Handle of a scene body in all environments. See :class:`frobs_core.contracts.BodyHandle`."""

    def __init__(self, simulation: GazeboSimulation, name: str, body: Body) -> None:
        self.name = name
        self._simulation, self._body = simulation, body
        self._span = simulation.layout.bodies.get(("body", name))  # None if the body is static or kinematic

    def _state(self) -> tuple[Floats, Floats]:
        """Return the pose, (num_envs, 7), and the twist, (num_envs, 6), of the body's origin."""
        if self._span is None:
            return self._simulation.stands[self.name], np.zeros((self._simulation.num_envs, 6))
        return self._simulation.origin_state(self._span.start)

    @property
    def pose(self) -> tuple[Floats, Floats]:
        pose, _ = self._state()
        return read_only(pose[:, :3]), read_only(pose[:, 3:])

    @property
    def twist(self) -> tuple[Floats, Floats]:
        _, twist = self._state()
        return read_only(twist[:, :3]), read_only(twist[:, 3:])

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        if self._span is None and not self._body.kinematic:
            raise SimulationError(
                f"body '{self.name}' is static, so its pose cannot be set; make it kinematic or set a mass."
            )
        envs = self._simulation.envs(mask)
        pose = np.empty((len(envs), 7))
        pose[:, :3] = pos
        pose[:, 3:] = self.pose[1][envs] if quat_wxyz is None else quat_wxyz
        self._put(envs, pose, np.zeros(6))

    def write_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        if self._span is None:
            raise SimulationError(f"body '{self.name}' is not free, so its velocity cannot be set; set a mass.")
        envs = self._simulation.envs(mask)
        twist = np.empty((len(envs), 6))
        twist[:, :3], twist[:, 3:] = lin_vel_world, ang_vel_world
        self._put(envs, self._state()[0][envs], twist)

    def put_home(self, envs: Sequence[int]) -> None:
        """Set a free body to its initial pose and velocity in the scene."""
        if self._span is not None:
            self._put(envs, np.tile(pose_array(self._body.pose), (len(envs), 1)), np.concatenate(self._body.twist))

    def _put(self, envs: Sequence[int], pose: Floats, twist: Floats) -> None:
        """Set the body's pose (k, 7) and twist (k, 6) in k environments."""
        if self._span is None:
            self._simulation.place(self.name, pose, envs)
            return
        raw = np.empty((len(envs), 1, 13))
        raw[:, 0, :7], raw[:, 0, 7:] = pose, twist
        arm = quat_rotate(pose[:, 3:], self._simulation.layout.coms[self._span.start])
        raw[:, 0, :3] += arm
        raw[:, 0, 7:10] += np.cross(raw[:, 0, 10:], arm)
        self._simulation.write(self._span, raw, envs, _NO_JOINTS, np.zeros((len(envs), 0)))
