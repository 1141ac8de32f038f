"""The handle of a robot in a PyBullet simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.description import Placement
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import SimulationError

if TYPE_CHECKING:
    from frobs_sim_pybullet.simulation import PybulletSimulation


class PybulletRobot(RobotHandle):
    """Handle of a robot in all environments. See :class:`frobs_core.contracts.RobotHandle`."""

    def __init__(self, simulation: PybulletSimulation, name: str, placement: Placement) -> None:
        self._simulation = simulation
        self.describe(name, placement, simulation.num_envs)
        arrays = {
            field: simulation.arrays[f"robots/{name}/{field}"]
            for field in ("command", "gains", "positions", "velocities", "efforts")
        }
        self._command = arrays["command"]
        self._kp, self._kd, self.joint_damping = (arrays["gains"][:, i] for i in range(3))  # (num_envs, dof) each
        self._positions, self._velocities = read_only(arrays["positions"]), read_only(arrays["velocities"])
        self._efforts = read_only(arrays["efforts"])
        self.joint_damping[:] = [joint.damping for joint in self.model.actuated_joints]
        self.apply_gains()
        self._poses: dict[str, tuple[Floats, Floats]] = {}

    @property
    def joint_positions(self) -> Floats:
        return self._positions

    @property
    def joint_velocities(self) -> Floats:
        return self._velocities

    @property
    def joint_efforts(self) -> Floats:
        return self._efforts

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        self._simulation.call("write_joints", mask, self.name, (positions, (self.dof,)), (velocities, (self.dof,)))

    def set_command_mode(self, mode: CommandMode | Sequence[CommandMode]) -> None:
        self._set_modes(mode)
        self.apply_gains()
        self.hold(slice(None))

    def apply_gains(self) -> None:
        """Pass each environment's gains for the current command mode to the drives."""
        self._kp[:], self._kd[:] = self._active_stiffness, self._active_damping

    def write_gains(self, which: int, rows: slice | np.ndarray, values: Floats) -> None:
        """Set Kp (``which=0``) or Kd (``which=1``) in the environments ``rows``, but not the drives' targets."""
        self._command[rows] *= self._write_gains(which, rows, values)
        self.apply_gains()

    def command(self, values: Floats) -> None:
        if values.ndim == 2:
            np.multiply(self._factor, values, out=self._command)
            self._simulation.command_rows.pop(self.name, None)
        else:
            self._simulation.command_rows[self.name] = self._factor[:, None] * values

    def hold(self, rows: slice | np.ndarray) -> None:
        """Hold the robot in the environments ``rows``: command the current positions, zero velocity or zero effort."""
        self._command[rows] = (self._factor * self.holding_command(self._positions))[rows]

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        return self.frame_pose(self.model.root)

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        return self.frame_velocity(self.model.root)

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        n = self._simulation.count(mask)
        pose = np.concatenate([np.broadcast_to(pos, (n, 3)), np.broadcast_to(quat_wxyz, (n, 4))], axis=1)
        self._simulation.call("write_base_pose", mask, self.name, (pose, (7,)))

    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        if self.robot.base == "fixed":
            raise SimulationError(f"robot '{self.name}' has a fixed base, so its velocity cannot be set.")
        n = self._simulation.count(mask)
        twist = np.concatenate([np.broadcast_to(lin_vel_world, (n, 3)), np.broadcast_to(ang_vel_world, (n, 3))], axis=1)
        self._simulation.call("write_base_twist", mask, self.name, (twist, (6,)))

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        if joint_positions is not None:
            return self.planned_frame_pose(frame, joint_positions)
        poses = self._poses.get(frame)
        if poses is None:
            pose = self._watched("pose", frame)
            poses = self._poses[frame] = pose[:, :3], pose[:, 3:]  # views that the worlds update in place
        return poses

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        twist = self._watched("twist", frame)
        return twist[:, :3], twist[:, 3:]

    def frame_jacobian(self, frame: str) -> Floats:
        return self._watched("jacobian", frame)

    def lidar(self, name: str) -> Floats:
        lidar, origins, directions = self.lidar_rays(name)
        return np.maximum(self._simulation.rays(origins, directions, lidar.range_max, self.name), lidar.range_min)

    def _watched(self, kind: str, frame: str) -> Floats:
        return self._simulation.watched(f"robots/{self.name}/{kind}/{self.frame_name(frame)}")
