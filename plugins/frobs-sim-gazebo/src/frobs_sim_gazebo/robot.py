"""The handle of a robot in a Gazebo simulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle, Snapshot, Stateful
from frobs_core.description import Placement
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import SimulationError
from frobs_core.util.rotations import quat_multiply, quat_rotate

if TYPE_CHECKING:
    from frobs_sim_gazebo.simulation import GazeboSimulation


_UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])


class GazeboRobot(Stateful, RobotHandle):
    """Handle of a robot in all environments. See :class:`frobs_core.contracts.RobotHandle`.

    Link poses are computed from the base pose and the joint positions, as a real robot's controller would do. Gazebo
    connects links with constraint forces, so the link poses in Gazebo may be off by a few micrometers.
    """

    def __init__(self, simulation: GazeboSimulation, name: str, placement: Placement) -> None:
        self._simulation = simulation
        self.describe(name, placement, simulation.num_envs)
        self._bones = simulation.layout.skeletons[name]
        self._joints, self._links = simulation.layout.joints[name], simulation.layout.bodies["robot", name]
        self.columns = self._joints.start + np.array(self._bones.actuated, np.intp)
        self._fixed = self.robot.base == "fixed"
        self.joint_damping = self.expand([joint.damping for joint in self.model.actuated_joints])
        self._friction = np.array([joint.friction for joint in self.model.actuated_joints])
        self._seen: dict[str, tuple[int, tuple[Floats, ...]]] = {}

    @property
    def joint_positions(self) -> Floats:
        return read_only(self._simulation.positions[:, self.columns])

    @property
    def joint_velocities(self) -> Floats:
        return read_only(self._simulation.velocities[:, self.columns])

    @property
    def joint_efforts(self) -> Floats:
        return read_only(self._simulation.efforts[:, self.columns])

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        envs = self._simulation.envs(mask)
        shape = len(envs), self.dof
        q = np.broadcast_to(np.asarray(positions, np.float64), shape)
        v = np.broadcast_to(np.asarray(velocities, np.float64), shape)
        base, motion = self._base_state()
        self._put(envs, base[envs], motion[envs], q, v)

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
            pos, quat, axes = bones.place(base, positions)
            lin, ang = bones.move(pos, axes, motion, velocities)
            arms = quat_rotate(quat, simulation.layout.coms[links])
            raw = np.empty((len(envs), len(bones.bodies), 13))
            raw[..., :3], raw[..., 3:7] = pos + arms, quat
            raw[..., 7:10], raw[..., 10:] = lin + np.cross(ang, arms), ang
        simulation.write(links, raw, envs, self._joints, positions)
        for row, env in enumerate(envs):
            if simulation.is_sound(env):
                simulation.positions[env, self._joints] = positions[row]
                simulation.velocities[env, self._joints] = velocities[row]
                simulation.bases[self.name][env] = base[row]

    def set_command_mode(self, mode: CommandMode | Sequence[CommandMode]) -> None:
        super().set_command_mode(mode)
        self._simulation.stale_gains[:] = True

    def write_gains(self, which: int, rows: slice | np.ndarray, values: Floats) -> None:
        """Set Kp (``which=0``) or Kd (``which=1``) in the environments selected by ``rows``."""
        self._write_gains(which, rows, values)
        self._simulation.stale_gains[rows] = True

    def drive_parameters(self, env: int) -> Floats:
        """Return the drive parameters in an environment: Kp, Kd, damping, friction and effort limit, (dof, 5)."""
        gains = self._active_stiffness[env], self._active_damping[env]
        return np.stack([*gains, self.joint_damping[env], self._friction, self.effort_limit[env]], axis=1)

    def take_targets(self, decimation: int) -> Floats:
        """Return the drive targets of the next step, (num_envs, decimation, dof): Kp·q*, Kd·v* or ff.

        After the step, the drives hold the targets in the last row.
        """
        return self._factor[:, None] * self._take_commands(decimation)

    def hold(self, envs: Sequence[int]) -> None:
        """Hold the robot in some environments: command the current positions, zero velocity or zero effort."""
        rows = list(envs)
        self._command[rows], self._command_rows = self.holding_command(self.joint_positions)[rows], None

    def stored_arrays(self) -> Snapshot:
        base = self._simulation.bases[self.name]
        return {"base": base, "command": self._command, "joint_damping": self.joint_damping}

    def _base_state(self) -> tuple[Floats, Floats]:
        """Return the pose, (num_envs, 7), and the twist, (num_envs, 6), of the root link in the world frame."""
        if self._fixed:
            return self._simulation.bases[self.name], np.zeros((self.num_envs, 6))
        return self._simulation.origin_state(self._links.start)

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        base, _ = self._base_state()
        return read_only(base[:, :3]), read_only(base[:, 3:])

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        _, motion = self._base_state()
        return read_only(motion[:, :3]), read_only(motion[:, 3:])

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        envs = self._simulation.envs(mask)
        base = np.empty((len(envs), 7))
        base[:, :3], base[:, 3:] = pos, quat_wxyz
        self._put(envs, base, self._base_state()[1][envs], self.joint_positions[envs], self.joint_velocities[envs])

    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        if self._fixed:
            raise SimulationError(f"robot '{self.name}' has a fixed base, so its velocity cannot be set.")
        envs = self._simulation.envs(mask)
        motion = np.empty((len(envs), 6))
        motion[:, :3], motion[:, 3:] = lin_vel_world, ang_vel_world
        self._put(envs, self._base_state()[0][envs], motion, self.joint_positions[envs], self.joint_velocities[envs])

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        link = self.frame_name(frame)
        if joint_positions is not None:
            base = self._simulation.layout.start(self.name)[None]
            return self._on_base(base, *self.model.frame_pose(link, joint_positions))
        pos, quat = self._cached(
            f"pose {link}",
            lambda: self._on_base(self._base_state()[0], *self.model.frame_pose(link, self.joint_positions)),
        )
        return pos, quat

    def _on_base(self, base: Floats, pos: Floats, quat: Floats) -> tuple[Floats, Floats]:
        if (base[:, 3:] == _UNTURNED).all():  # most arms require no rotation
            return pos + base[:, :3], quat
        turn = np.broadcast_to(base[:, 3:], quat.shape)
        return quat_rotate(turn, pos) + base[:, :3], quat_multiply(turn, quat)

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        link = self.frame_name(frame)
        pos, quat, axes = self._placed()
        body, at = self._bones.on_body(link, pos, quat)
        velocities = self._simulation.velocities[:, self._joints]
        lin, ang = self._bones.move(pos, axes, self._base_state()[1], velocities)
        return read_only(lin[:, body] + np.cross(ang[:, body], at - pos[:, body])), read_only(ang[:, body])

    def frame_jacobian(self, frame: str) -> Floats:
        link = self.frame_name(frame)
        (jacobian,) = self._cached(f"jacobian {link}", lambda: (self._bones.jacobian(link, *self._placed()),))
        return jacobian

    def _placed(self) -> tuple[Floats, Floats, Floats]:
        pos, quat, axes = self._cached(
            "bodies", lambda: self._bones.place(self._base_state()[0], self._simulation.positions[:, self._joints])
        )
        return pos, quat, axes

    def _cached(self, what: str, compute: Callable[[], tuple[Floats, ...]]) -> tuple[Floats, ...]:
        """Return arrays that depend on the state, and compute them only once per state."""
        version, values = self._seen.get(what, (-1, ()))
        if version != self._simulation.version:
            values = tuple(map(read_only, compute()))
            self._seen[what] = self._simulation.version, values
        return values

    def lidar(self, name: str) -> Floats:
        lidar, origins, directions = self.lidar_rays(name)
        return np.maximum(self._simulation.rays(origins, directions, lidar.range_max, self.name), lidar.range_min)
