"""Joint groups: the joints of a robot that one controller moves."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from frobs_core.description.robot import EndEffector, Robot
from frobs_core.models.model import Joint, RobotModel
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnknownNameError, check_name


class JointGroup(ABC):
    """A controller's read-only view of one robot's joints, in all environments.

    A robot's handle is itself a joint group that contains all actuated joints. Arrays are (num_envs, …) float64,
    read-only, and valid until the simulation's state changes.

    Attributes:
        name: Name of the robot in the simulation, such as ``"robot"``.
        robot: Description of the robot.
        model: Parsed model file of the robot.
        num_envs: Number of environments.
        joints: The joints, in the order of all joint arrays.
        joint_names: Names of the joints, in the order of ``joints``.
        dof: Number of joints.
        tcp: Name of the link that serves as the tool center point.
        group_name: Name of the joint group, or empty if the joints are not one of the robot's groups.
        end_effector: End effector that the group carries or moves, or None. If a handle contains all joints
            of a robot with several groups, this is the robot's first gripper, or else its first end effector.
        home: Home positions, (num_envs, dof) [rad or m].
        position_lower: Lower position limits, (num_envs, dof) [rad or m], which are −inf for joints without a limit.
        position_upper: Upper position limits, (num_envs, dof) [rad or m], which are inf for joints without a limit.
        velocity_limit: Velocity limits, (num_envs, dof) [rad/s or m/s].
        effort_limit: Effort limits, (num_envs, dof) [N·m or N].
    """

    name: str
    robot: Robot
    model: RobotModel
    num_envs: int
    joints: tuple[Joint, ...]
    joint_names: tuple[str, ...]
    dof: int
    tcp: str
    group_name: str = ""
    end_effector: EndEffector | None = None
    home: Floats
    position_lower: Floats
    position_upper: Floats
    velocity_limit: Floats
    effort_limit: Floats

    @property
    @abstractmethod
    def joint_positions(self) -> Floats:
        """(num_envs, dof) [rad or m]."""

    @property
    @abstractmethod
    def joint_velocities(self) -> Floats:
        """(num_envs, dof) [rad/s or m/s]."""

    @property
    @abstractmethod
    def joint_efforts(self) -> Floats:
        """Efforts that the drives applied in the last physics step, (num_envs, dof) [N·m or N]."""

    @abstractmethod
    def drive_gains(self) -> tuple[Floats, Floats]:
        """Return Kp and Kd, (num_envs, dof) each, independent of the command mode."""

    @property
    @abstractmethod
    def base_pose(self) -> tuple[Floats, Floats]:
        """Pose of the robot's root link in the world frame: pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4)."""

    @property
    @abstractmethod
    def base_twist(self) -> tuple[Floats, Floats]:
        """Twist at the root link's origin: lin_vel_world (num_envs, 3) [m/s], ang_vel_world (num_envs, 3) [rad/s]."""

    @abstractmethod
    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        """Return the pose of a link in the world frame.

        Args:
            frame: Name of a link, or ``"tcp"``.
            joint_positions: Joint positions at which to compute the pose, (k, dof) [rad or m] for any k, or None for
                the current pose. If positions are given, the pose is computed with the base at its initial pose in the
                scene and all other joints at their home positions. The simulation's state does not change.

        Returns:
            The pose: pos (num_envs or k, 3) [m] and quat_wxyz (num_envs or k, 4).

        Raises:
            UnknownNameError: There is no link with this name.
        """

    @abstractmethod
    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        """Return lin_vel_world [m/s] and ang_vel_world [rad/s] of the origin of ``frame``, (num_envs, 3) each."""

    @abstractmethod
    def frame_jacobian(self, frame: str) -> Floats:
        """Return the Jacobian of ``frame``, (num_envs, 6, dof): lin_vel_world in rows 0–2, ang_vel_world in 3–5."""

    def frame_name(self, frame: str) -> str:
        """Return the name of the existing link ``frame``, where ``"tcp"`` is the tool center point's link.

        Raises:
            UnknownNameError: There is no link with this name.
        """
        name = self.tcp if frame == "tcp" else frame
        links = [link.name for link in self.model.links]
        if name not in links:
            raise UnknownNameError("link", name, links if frame == "tcp" else [*links, "tcp"])
        return name


class JointSubset(JointGroup):
    """A subset of a robot's joints.

    Args:
        whole: Group that contains the joints.
        joint_names: Names of the selected joints, in the order of the arrays.
        tcp: Link that is the group's tool center point, or None for the robot's tool center point.
        group_name: Name of the joint group, or empty if the joints are not one of the robot's groups.

    Attributes:
        columns: Indices of the selected joints in the joint arrays of ``whole``.

    Raises:
        UnknownNameError: The robot has no joint or link with a given name.
    """

    def __init__(
        self, whole: JointGroup, joint_names: Sequence[str], tcp: str | None = None, group_name: str = ""
    ) -> None:
        for joint in joint_names:
            check_name(f"actuated joint of robot '{whole.robot.name}'", joint, whole.joint_names)
        self._whole = whole
        self.name, self.robot, self.model, self.num_envs = whole.name, whole.robot, whole.model, whole.num_envs
        numbers = [whole.joint_names.index(joint) for joint in joint_names]
        start = numbers[0] if numbers else 0
        consecutive = numbers == list(range(start, start + len(numbers)))
        self.columns: slice | np.ndarray = slice(start, start + len(numbers)) if consecutive else np.array(numbers)
        self.joints = tuple(whole.joints[number] for number in numbers)
        self.joint_names, self.dof = tuple(joint_names), len(numbers)
        self.tcp = tcp or whole.tcp
        self.group_name = group_name
        self.end_effector = self.robot.end_effector_of(group_name) if group_name else None
        self.frame_name("tcp")
        for limit in ("home", "position_lower", "position_upper", "velocity_limit", "effort_limit"):
            setattr(self, limit, getattr(whole, limit)[:, self.columns])

    joint_positions = property(lambda self: self._whole.joint_positions[:, self.columns])
    joint_velocities = property(lambda self: self._whole.joint_velocities[:, self.columns])
    joint_efforts = property(lambda self: self._whole.joint_efforts[:, self.columns])
    base_pose = property(lambda self: self._whole.base_pose)
    base_twist = property(lambda self: self._whole.base_twist)

    def drive_gains(self) -> tuple[Floats, Floats]:
        stiffness, damping = self._whole.drive_gains()
        return stiffness[:, self.columns], damping[:, self.columns]

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        whole, link = self._whole, self.tcp if frame == "tcp" else frame
        if joint_positions is None:
            return whole.frame_pose(link)
        positions = np.repeat(whole.home[:1], len(joint_positions), axis=0)
        positions[:, self.columns] = joint_positions
        return whole.frame_pose(link, positions)

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        return self._whole.frame_velocity(self.tcp if frame == "tcp" else frame)

    def frame_jacobian(self, frame: str) -> Floats:
        return self._whole.frame_jacobian(self.tcp if frame == "tcp" else frame)[:, :, self.columns]
