"""The handle of a simulated robot, with methods to read and write its state and to command its drives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.contracts.body_handle import BodyHandle
from frobs_core.contracts.joint_group import JointGroup, JointSubset
from frobs_core.description.robot import ALL, CommandMode
from frobs_core.description.scene import Placement
from frobs_core.description.sensor import Lidar
from frobs_core.models.defaults import default_tcp, home_positions
from frobs_core.models.kinematics import joint_path, link_poses
from frobs_core.models.model import JointType, Pose
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import CapabilityError, SimulationError, UnsuitableRobotError, check_name
from frobs_core.util.rotations import Number, quat_multiply, quat_rotate


class RobotHandle(JointGroup):
    """Handle of a simulated robot in all environments.

    The drive law, evaluated at each physics step, is effort = clip(Kp·(q* − q) − Kd·q̇ + ff, ± effort limit), with
    implicit damping. ``POSITION`` commands q* with ff = 0; ``VELOCITY`` commands v* as ff = Kd·v* with Kp = 0;
    ``EFFORT`` commands ff with Kp = Kd = 0. Each joint has its own command mode.

    Attributes:
        command_modes: Command mode of each joint, (dof,).
        base: Handle of the root link as a body, or None if the base is fixed or the simulator overrides the methods
            that read and write the base's state.
    """

    command_modes: tuple[CommandMode, ...]
    base: BodyHandle | None = None
    _command: Floats
    _command_rows: Floats | None
    _start: Pose
    _stiffness: Floats
    _damping: Floats
    _active_stiffness: Floats
    _active_damping: Floats
    _factor: Floats

    def describe(self, name: str, placement: Placement, num_envs: int) -> None:
        """Set all attributes of the class from the placement. A subclass's constructor must call this method first.

        Args:
            name: Name of the robot in the simulation.
            placement: Placement of the robot.
            num_envs: ≥ 1.

        Raises:
            UnknownNameError: The model does not contain the tool center point or a joint of the home position.
        """
        model, robot = placement.model, placement.robot
        self.name, self.robot, self.model, self.num_envs = name, robot, model, num_envs
        self.joints, self.joint_names, self.dof = model.actuated_joints, model.joint_names, len(model.joint_names)
        self.tcp = robot.tcp or default_tcp(model)
        self.frame_name("tcp")
        groups = robot.groups or {ALL: self.joint_names}
        self.group_name = next((group for group, joints in groups.items() if tuple(joints) == self.joint_names), "")
        self.end_effector = robot.end_effector_of(self.group_name)
        self._start = placement.pose
        limits = [joint.limits for joint in self.joints]
        self.home = self.expand(home_positions(model, robot.home))
        self.position_lower = self.expand([limit.lower for limit in limits])
        self.position_upper = self.expand([limit.upper for limit in limits])
        self.velocity_limit = self.expand([limit.velocity for limit in limits])
        self.effort_limit = self.expand([limit.effort for limit in limits])
        self._stiffness, self._damping = map(self.expand, placement.drive_gains)
        self.command_modes = placement.command_modes
        self.refresh_gains()
        self._command, self._command_rows = self.holding_command(self.home), None

    def expand(self, row: Sequence[float] | Floats) -> Floats:
        """Repeat a ``row`` of per-joint values, (dof,), for all environments, (num_envs, dof)."""
        return np.repeat(np.asarray(row, np.float64)[None], self.num_envs, axis=0)

    def group(self, joint_names: Sequence[str], tcp: str | None = None, *, name: str = "") -> JointGroup:
        """Return a group of joints for a controller.

        If the group contains all joints in their original order and uses the robot's tool center point, this method
        returns the handle itself.

        Args:
            joint_names: Names of the joints in the group.
            tcp: Link that is the group's tool center point. If None, it is the tool center point of the end effector
                that the named group carries, or the robot's.
            name: Name of the group in the robot's description, or empty if the joints are not one of its groups.

        Raises:
            UnknownNameError: The robot has no actuated joint or link with this name.
        """
        tool = self.robot.end_effector_of(name) if name and tcp is None else None
        if tool is not None and name == (tool.arm or next(iter(self.robot.groups))):
            tcp = tool.tcp
        if tuple(joint_names) == self.joint_names and tcp in (None, self.tcp):
            return self
        return JointSubset(self, joint_names, tcp, name)

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        """Set the joint state without simulating the motion.

        Args:
            positions: (n, dof) [rad or m]
            velocities: (n, dof) [rad/s or m/s]
            mask: The environments to change.

        Raises:
            CapabilityError: The simulator does not support ``teleport``.
        """
        raise CapabilityError.lacking(self, "teleport")

    @property
    def command_mode(self) -> CommandMode:
        """Command mode of all joints.

        Raises:
            UnsuitableRobotError: The joints have different command modes. Use ``command_modes`` instead.
        """
        modes = set(self.command_modes)
        if len(modes) > 1:
            raise UnsuitableRobotError(
                self.robot.name, "has joints with different command modes; use command_modes instead."
            )
        return next(iter(modes), CommandMode.POSITION)

    def set_command_mode(self, mode: CommandMode | Sequence[CommandMode]) -> None:
        """Change the command mode and, depending on the mode, hold the current positions, zero velocity or zero effort.

        Args:
            mode: One mode for all joints, or one mode for each joint.
        """
        self._set_modes(mode)
        self.command(self.holding_command(self.joint_positions))

    def _set_modes(self, mode: CommandMode | Sequence[CommandMode]) -> None:
        self.command_modes = (mode,) * self.dof if isinstance(mode, CommandMode) else tuple(mode)
        self.refresh_gains()

    def command(self, values: Floats) -> None:
        """Set the drives' targets for the next steps.

        The default implementation stores the targets until the next step.

        Args:
            values: Targets, (num_envs, dof) or (num_envs, decimation, dof). Targets of shape (num_envs, dof) are held
                constant. Targets of shape (num_envs, decimation, dof) have one row for each physics step of the next
                ``step``, which must use the same ``decimation``. After this ``step``, the last row is held.
        """
        self._command_rows = np.array(values) if values.ndim == 3 else None
        self._command[:] = values[:, -1] if values.ndim == 3 else values

    def _take_commands(self, decimation: int) -> Floats:
        """Return the command for each physics step of the next ``step``, (num_envs, decimation, dof).

        Args:
            decimation: Number of physics steps.
        """
        rows, self._command_rows = self._command_rows, None
        if rows is None:
            return np.repeat(self._command[:, None], decimation, axis=1)
        if rows.shape[1] != decimation:
            raise SimulationError(
                f"the command of robot '{self.name}' has {rows.shape[1]} rows, but the step has {decimation} physics "
                "steps."
            )
        return rows

    def drive_gains(self) -> tuple[Floats, Floats]:
        """Return Kp and Kd, (num_envs, dof) each. Change the gains only through ``write_parameter``."""
        return self._stiffness, self._damping

    def refresh_gains(self) -> None:
        """Recompute the factors of the drive law after the gains or command modes have changed."""
        self._active_stiffness, self._active_damping, self._factor = active_gains(
            self.command_modes, self._stiffness, self._damping
        )

    def _write_gains(self, which: int, rows: slice | np.ndarray, values: Floats) -> Floats:
        """Set Kp (``which=0``) or Kd (``which=1``) for the environments in ``rows``.

        Returns:
            Factors by which to multiply the current commands, (n, dof), so that the drives' targets do not change.
        """
        before = self._factor[rows]
        self.drive_gains()[which][rows] = values
        self.refresh_gains()
        return np.divide(self._factor[rows], before, out=np.ones_like(before), where=before > 0)

    def holding_command(self, joint_positions: Floats) -> Floats:
        """Return the hold command for each joint's mode: the given positions, zero velocity or zero effort.

        Args:
            joint_positions: (…, dof) [rad or m]

        Returns:
            (…, dof), in the unit of each joint's command mode.
        """
        held = np.array([mode == CommandMode.POSITION for mode in self.command_modes], bool)
        return np.where(held, joint_positions, 0.0)

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        if self.base is not None:
            return self.base.pose
        n = self.num_envs
        return np.tile(self._start.pos, (n, 1)), np.tile(self._start.quat_wxyz, (n, 1))

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        if self.base is not None:
            return self.base.twist
        return np.zeros((self.num_envs, 3)), np.zeros((self.num_envs, 3))

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        """Teleport the root link. A fixed base can also be teleported.

        Args:
            pos: (n, 3) [m] in the world frame.
            quat_wxyz: Unit quaternions, (n, 4).
            mask: The environments to change.

        Raises:
            CapabilityError: The simulator does not support ``teleport``.
        """
        raise CapabilityError.lacking(self, "teleport")

    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        """Set the velocity of a free root link.

        Args:
            lin_vel_world: (n, 3) [m/s]
            ang_vel_world: (n, 3) [rad/s]
            mask: The environments to change.

        Raises:
            CapabilityError: The simulator does not support ``teleport``.
            SimulationError: The base is fixed.
        """
        if self.base is None:
            raise CapabilityError.lacking(self, "teleport")
        self.base.write_twist(lin_vel_world, ang_vel_world, mask)

    # The methods below compute kinematics from the model, the joint state and the base pose.
    # Handles for engines that compute kinematics themselves override these methods.

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        if joint_positions is not None:
            return self.planned_frame_pose(frame, joint_positions)
        pos, quat = self.model.frame_pose(self.frame_name(frame), self.joint_positions)
        base_pos, base_quat = self.base_pose
        return base_pos + quat_rotate(base_quat, pos), quat_multiply(base_quat, quat)

    def planned_frame_pose(self, frame: str, joint_positions: Floats) -> tuple[Floats, Floats]:
        """Return the pose of ``frame`` in the world frame at ``joint_positions``, (k, dof) [rad or m]."""
        pos, quat = self.model.frame_pose(self.frame_name(frame), joint_positions)
        base = np.broadcast_to(np.array(self._start.quat_wxyz), quat.shape)
        return quat_rotate(base, pos) + np.array(self._start.pos), quat_multiply(base, quat)

    def link_poses(self) -> tuple[Floats, Floats]:
        """Return the poses of all links in the world frame, in the order of ``model.links``.

        Passive joints are at zero, unless the handle reads the poses from its engine.

        Returns:
            pos (num_envs, links, 3) [m] and quat_wxyz (num_envs, links, 4).
        """
        pos, quat = link_poses(self.model, self.joint_positions)
        base_pos, base_quat = (each[:, None] for each in self.base_pose)
        return base_pos + quat_rotate(base_quat, pos), quat_multiply(base_quat, quat)

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        twist = (self.frame_jacobian(frame) * self.joint_velocities[:, None, :]).sum(axis=-1)  # (num_envs, 6)
        linear, angular = self.base_twist
        lever = self.frame_pose(frame)[0] - self.base_pose[0]
        return twist[:, :3] + linear + np.cross(angular, lever), twist[:, 3:] + angular

    def frame_jacobian(self, frame: str) -> Floats:
        return self.point_jacobian(self.frame_name(frame), self.frame_pose(frame)[0])

    def point_jacobian(self, link: str, point: Floats) -> Floats:
        """Return the Jacobian of a point that moves with a link.

        Args:
            link: Name of the link.
            point: (num_envs, 3) [m] in the world frame.

        Returns:
            The Jacobian, (num_envs, 6, dof), with lin_vel_world in rows 0–2 and ang_vel_world in rows 3–5.
        """
        jacobian = np.zeros((self.num_envs, 6, self.dof))
        for joint in joint_path(self.model, link):
            leader = self.model.leader(joint)
            if leader is None:
                continue
            pos, quat = self.frame_pose(joint.child)
            axis = quat_rotate(quat, np.broadcast_to(np.array(joint.axis), pos.shape))
            axis = axis * leader.multiplier
            column = self.joint_names.index(leader.joint)
            if joint.type is JointType.PRISMATIC:
                jacobian[:, :3, column] += axis
            else:
                jacobian[:, :3, column] += np.cross(axis, point - pos)
                jacobian[:, 3:, column] += axis
        return jacobian

    def lidar(self, name: str) -> Floats:
        """Return the ranges measured by one of the robot's lidars, (num_envs, rays) [m].

        The lidar does not detect the robot itself.

        Raises:
            CapabilityError: The simulator does not support ``rays``.
            UnknownNameError: The robot has no lidar with this name.
        """
        raise CapabilityError.lacking(self, "rays")

    def lidar_rays(self, name: str) -> tuple[Lidar, Floats, Floats]:
        """Return a lidar and its rays' origins [m] and directions in the world frame, (num_envs, rays, 3) each.

        Raises:
            UnknownNameError: The robot has no lidar with this name.
        """
        lidars = self.robot.lidars
        lidar = lidars[check_name("lidar", name, lidars)]
        pos, quat = self.frame_pose(lidar.frame)
        if self.num_envs == 1:  # Python floats are faster here and round in the same way
            ahead, left = np.array(_xy_axes(*quat[0].tolist())).reshape(2, 1, 1, 3)
        else:
            ahead, left = np.array(_xy_axes(*quat.T)).reshape(2, 3, self.num_envs, 1).transpose(0, 2, 3, 1)
        directions = lidar.directions[:, 0:1] * ahead + lidar.directions[:, 1:2] * left
        if any(lidar.offset):
            pos = pos + quat_rotate(quat, np.broadcast_to(np.array(lidar.offset), pos.shape))
        return lidar, pos[:, None].repeat(lidar.rays, axis=1), directions


def _xy_axes(w: Number, x: Number, y: Number, z: Number) -> tuple[Number, Number, Number, Number, Number, Number]:
    """Return the x and y axes of a frame rotated by a quaternion."""
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y + w * z),
        2.0 * (x * z - w * y),
        2.0 * (x * y - w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z + w * x),
    )


def active_gains(modes: Sequence[CommandMode], stiffness: Floats, damping: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the factors by which the drive law multiplies errors and commands.

    Args:
        modes: Command mode of each joint, (dof,).
        stiffness: Kp of the drives, (…, dof) [N·m/rad or N/m].
        damping: Kd of the drives, (…, dof) [N·m·s/rad or N·s/m].

    Returns:
        Kp, Kd and the factor that converts a command into an effort (Kp for positions, Kd for velocities, 1 for
        efforts), (…, dof) each, as new arrays.
    """
    position = np.array([mode == CommandMode.POSITION for mode in modes], bool)
    effort = np.array([mode == CommandMode.EFFORT for mode in modes], bool)
    factor = np.where(position, stiffness, np.where(effort, 1.0, damping))
    return np.where(position, stiffness, 0.0), np.where(effort, 0.0, damping), factor
