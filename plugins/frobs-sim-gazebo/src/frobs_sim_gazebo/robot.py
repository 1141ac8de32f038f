"""The handle of a robot in a Gazebo simulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.description import Placement
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import SimulationError
from frobs_core.util.rotations import quat_from_matrix, quat_multiply, quat_rotate

if TYPE_CHECKING:
    from frobs_sim_gazebo.simulation import GazeboSimulation


_UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])


class GazeboRobot(RobotHandle):
    """Handle of a robot in all environments. See :class:`frobs_core.contracts.RobotHandle`.

    Link poses are computed from the base pose and the joint positions, as a real robot's controller would do. Gazebo
    connects links with constraint forces, so the link poses in Gazebo may be off by a few micrometers.
    """

    def __init__(self, simulation: GazeboSimulation, name: str, placement: Placement) -> None:
        self._simulation = simulation
        self.describe(name, placement, simulation.num_envs)
        self._bones = simulation.layout.skeletons[name]
        self._joints, self._links = simulation.layout.joints[name], simulation.layout.bodies["robot", name]
        self._columns = self._joints.start + np.array(self._bones.actuated, np.intp)
        self._fixed = self.robot.base == "fixed"
        self.joint_damping = self.expand([joint.damping for joint in self.model.actuated_joints])
        self._friction = np.array([joint.friction for joint in self.model.actuated_joints])
        self.target = np.zeros_like(self.home)  # Kp·q*, Kd·v* or ff
        self._seen: dict[str, tuple[int, tuple[Floats, ...]]] = {}

    @property
    def joint_positions(self) -> Floats:
        """Joint positions, (num_envs, dof) [rad or m]."""
        return read_only(self._simulation.positions[:, self._columns])

    @property
    def joint_velocities(self) -> Floats:
        """Joint velocities, (num_envs, dof) [rad/s or m/s]."""
        return read_only(self._simulation.velocities[:, self._columns])

    @property
    def joint_efforts(self) -> Floats:
        """Efforts that the drives applied in the last physics step, (num_envs, dof) [N·m or N]."""
        return read_only(self._simulation.efforts[:, self._columns])

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        """Set the joint state without simulating the motion."""
        envs = self._simulation.envs(mask)
        shape = len(envs), self.dof
        q = np.broadcast_to(np.asarray(positions, np.float64), shape)
        v = np.broadcast_to(np.asarray(velocities, np.float64), shape)
        self._put(envs, self._base()[envs], self._base_motion()[envs], q, v)

    def put_home(self, envs: Sequence[int]) -> None:
        """Set the robot to its initial pose in the scene, with all joints at home and at rest."""
        k = len(envs)
        base = np.tile(self._simulation.layout.start(self.name), (k, 1))
        self._put(envs, base, np.zeros((k, 6)), self.home[envs], np.zeros((k, self.dof)))

    def _put(self, envs: Sequence[int], base: Floats, motion: Floats, q: Floats, v: Floats) -> None:
        """Set the base pose (k, 7) and twist (k, 6), and the joint positions and velocities (k, dof)."""
        simulation, bones, links = self._simulation, self._bones, self._links
        positions, velocities = bones.all_positions(q), bones.all_velocities(v)
        with np.errstate(invalid="ignore", over="ignore"):  # allow non-finite values, which end the episode later
            pos, turn, axes = bones.place(base, positions)
            lin, ang = bones.move(pos, axes, motion, velocities)
            arms = (turn * simulation.layout.coms[links][None, :, None, :]).sum(-1)
            raw = np.empty((len(envs), len(bones.bodies), 13))
            raw[..., :3] = pos + arms
            raw[..., 3:7] = quat_from_matrix(turn) if np.isfinite(turn).all() else np.nan
            raw[:, 0, 3:7] = base[:, 3:]
            raw[..., 7:10], raw[..., 10:] = lin + np.cross(ang, arms), ang
        simulation.write(links, raw, envs, self._joints, positions)
        for row, env in enumerate(envs):
            if simulation.is_sound(env):
                simulation.positions[env, self._joints] = positions[row]
                simulation.velocities[env, self._joints] = velocities[row]
                simulation.bases[self.name][env] = base[row]

    def set_command_mode(self, mode: CommandMode | Sequence[CommandMode]) -> None:
        """Change the command mode, and command the current positions, zero velocity or zero effort."""
        self._set_modes(mode)
        self._simulation.stale_gains[:] = True
        self._simulation.command_rows.pop(self.name, None)
        self.hold(range(self.num_envs))

    def write_gains(self, which: int, rows: slice | np.ndarray, values: Floats) -> None:
        """Set Kp (``which=0``) or Kd (``which=1``) in the environments selected by ``rows``, and keep drive targets."""
        self.target[rows] *= self._write_gains(which, rows, values)
        self._simulation.stale_gains[rows] = True

    def fill_gains(self, env: int, into: Floats) -> None:
        """Write the drive parameters of an environment to the array ``into``, (joints, 5)."""
        actuated = self._bones.actuated
        into[actuated, 0], into[actuated, 1] = self._active_stiffness[env], self._active_damping[env]
        into[actuated, 2], into[actuated, 3] = self.joint_damping[env], self._friction
        into[actuated, 4] = self.effort_limit[env]

    def command(self, values: Floats) -> None:
        """Set the drives' targets."""
        if values.ndim == 2:
            np.multiply(self._factor, values, out=self.target)
            self._simulation.command_rows.pop(self.name, None)
        else:
            self._simulation.command_rows[self.name] = self._factor[:, None] * values

    def fill(self, into: Floats, rows: Floats | None) -> None:
        """Write the drive targets of the next step to the array ``into``, (num_envs, rows, joints).

        After the step, the drives hold the targets in the last row.
        """
        if rows is not None:
            self.target[:] = rows[:, -1]
        into[:, :, self._bones.actuated] = self.target[:, None] if rows is None else rows

    def hold(self, envs: Sequence[int]) -> None:
        """Hold the robot in some environments: command the current positions, zero velocity or zero effort."""
        rows = list(envs)
        self.target[rows] = (self._factor * self.holding_command(self.joint_positions))[rows]

    def _base(self) -> Floats:
        """Return pos and quat_wxyz of the root link in the world frame, (num_envs, 7)."""
        if self._fixed:
            return self._simulation.bases[self.name]
        raw = self._simulation.raw[:, self._links.start]
        arm = quat_rotate(raw[:, 3:7], self._simulation.layout.coms[self._links.start])
        return np.concatenate([raw[:, :3] - arm, raw[:, 3:7]], axis=1)

    def _base_motion(self) -> Floats:
        """Return lin_vel_world and ang_vel_world at the root link's origin, (num_envs, 6)."""
        if self._fixed:
            return np.zeros((self.num_envs, 6))
        raw = self._simulation.raw[:, self._links.start]
        arm = quat_rotate(raw[:, 3:7], self._simulation.layout.coms[self._links.start])
        return np.concatenate([raw[:, 7:10] - np.cross(raw[:, 10:], arm), raw[:, 10:]], axis=1)

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        """Pose of the root link in the world frame: pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4)."""
        base = self._base()
        return read_only(base[:, :3]), read_only(base[:, 3:])

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        """Twist at the root link's origin: lin_vel_world (num_envs, 3) [m/s], ang_vel_world (num_envs, 3) [rad/s]."""
        motion = self._base_motion()
        return read_only(motion[:, :3]), read_only(motion[:, 3:])

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        """Teleport the root link."""
        envs = self._simulation.envs(mask)
        base = np.empty((len(envs), 7))
        base[:, :3], base[:, 3:] = pos, quat_wxyz
        self._put(envs, base, self._base_motion()[envs], self.joint_positions[envs], self.joint_velocities[envs])

    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        """Set the velocity of a free root link."""
        if self._fixed:
            raise SimulationError(f"robot '{self.name}' has a fixed base, so its velocity cannot be set.")
        envs = self._simulation.envs(mask)
        motion = np.empty((len(envs), 6))
        motion[:, :3], motion[:, 3:] = lin_vel_world, ang_vel_world
        self._put(envs, self._base()[envs], motion, self.joint_positions[envs], self.joint_velocities[envs])

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        """Return the pose of a link in the world frame, at the current or given joint positions."""
        link = self.frame_name(frame)
        if joint_positions is not None:
            base = self._simulation.layout.start(self.name)[None]
            return self._on_base(base, *self.model.frame_pose(link, joint_positions))
        pos, quat = self._cached(
            f"pose {link}", lambda: self._on_base(self._base(), *self.model.frame_pose(link, self.joint_positions))
        )
        return pos, quat

    def _on_base(self, base: Floats, pos: Floats, quat: Floats) -> tuple[Floats, Floats]:
        if (base[:, 3:] == _UNTURNED).all():  # most arms require no rotation
            return pos + base[:, :3], quat
        turn = np.broadcast_to(base[:, 3:], quat.shape)
        return quat_rotate(turn, pos) + base[:, :3], quat_multiply(turn, quat)

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        """Return lin_vel_world [m/s] and ang_vel_world [rad/s] of a link's origin, (num_envs, 3) each."""
        link = self.frame_name(frame)
        pos, turn, axes = self._placed()
        body, at, _ = self._bones.on_body(link, pos, turn)
        velocities = self._simulation.velocities[:, self._joints]
        lin, ang = self._bones.move(pos, axes, self._base_motion(), velocities)
        return read_only(lin[:, body] + np.cross(ang[:, body], at - pos[:, body])), read_only(ang[:, body])

    def frame_jacobian(self, frame: str) -> Floats:
        """Return a link's Jacobian in the world frame, (num_envs, 6, dof): linear rows 0–2 and angular rows 3–5."""
        link = self.frame_name(frame)
        (jacobian,) = self._cached(f"jacobian {link}", lambda: (self._bones.jacobian(link, *self._placed()),))
        return jacobian

    def _placed(self) -> tuple[Floats, Floats, Floats]:
        pos, turn, axes = self._cached(
            "bodies", lambda: self._bones.place(self._base(), self._simulation.positions[:, self._joints])
        )
        return pos, turn, axes

    def _cached(self, what: str, compute: Callable[[], tuple[Floats, ...]]) -> tuple[Floats, ...]:
        """Return arrays that depend on the state, and compute them only once per state."""
        version, values = self._seen.get(what, (-1, ()))
        if version != self._simulation.version:
            values = tuple(map(read_only, compute()))
            self._seen[what] = self._simulation.version, values
        return values

    def lidar(self, name: str) -> Floats:
        """Return the ranges measured by one of the robot's lidars, (num_envs, rays) [m]."""
        lidar, origins, directions = self.lidar_rays(name)
        return np.maximum(self._simulation.rays(origins, directions, lidar.range_max, self.name), lidar.range_min)
