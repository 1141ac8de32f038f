"""Joint groups: the joints of a robot that one controller moves."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import UnknownNameError
from frobs_core.interfaces.robot import Robot
from frobs_core.models.model import Joint, RobotModel


class JointGroup(ABC):
    """A controller's read-only view of one robot's joints, in all environments.

    The handle of a robot is the group of all its actuated joints. Arrays are (num_envs, …) float64 and read-only. They
    are valid until the simulation changes.

    Attributes:
        name: Name of the robot in the simulation: ``"robot"``.
        robot: Description of the robot.
        model: The parsed model file of the robot.
        num_envs: Number of environments.
        joints: The joints, in the order of every joint array.
        joint_names: Their names.
        dof: Number of joints.
        tcp: Name of the tool center point's link.
        home: (num_envs, dof) [rad or m]
        position_lower: (num_envs, dof) [rad or m]; −inf if a joint has no limit.
        position_upper: (num_envs, dof) [rad or m]
        velocity_limit: (num_envs, dof) [rad/s or m/s]
        effort_limit: (num_envs, dof) [N·m or N]
    """

    name: str
    robot: Robot
    model: RobotModel
    num_envs: int
    joints: tuple[Joint, ...]
    joint_names: tuple[str, ...]
    dof: int
    tcp: str
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
        """pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4) of the robot's root link in the world."""

    @property
    @abstractmethod
    def base_twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (num_envs, 3) [m/s] and ang_vel_world (num_envs, 3) [rad/s] of the root link's origin."""

    @abstractmethod
    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        """Return the pose of a link in the world.

        Args:
            frame: Name of a link, or ``"tcp"``.
            joint_positions: If None, return the current pose. If (k, dof) [rad or m], for any k, return the pose at
                these positions, with the base where the scene places it and all other joints at home. The state does
                not change.

        Returns:
            pos (num_envs or k, 3) [m] and quat_wxyz (num_envs or k, 4).

        Raises:
            UnknownNameError: There is no link with this name.
        """

    @abstractmethod
    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        """Return lin_vel_world [m/s] and ang_vel_world [rad/s] of a link's origin, (num_envs, 3) each."""

    @abstractmethod
    def frame_jacobian(self, frame: str) -> Floats:
        """Return (num_envs, 6, dof): rows 0–2 lin_vel_world, rows 3–5 ang_vel_world, per unit of joint velocity."""

    def frame_name(self, frame: str) -> str:
        """Resolve ``"tcp"`` and verify that the link exists.

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
        whole: Group that contains them.
        joint_names: Their names, in the order of the arrays.
        tcp: Link that is the group's tool center point, or None for the robot's tool center point.

    Attributes:
        columns: Columns of the joints in the joint arrays of ``whole``.

    Raises:
        UnknownNameError: The robot has no such joint or link.
    """

    def __init__(self, whole: JointGroup, joint_names: Sequence[str], tcp: str | None = None) -> None:
        for joint in joint_names:
            if joint not in whole.joint_names:
                raise UnknownNameError(f"actuated joint of robot '{whole.robot.name}'", joint, whole.joint_names)
        self._whole = whole
        self.name, self.robot, self.model, self.num_envs = whole.name, whole.robot, whole.model, whole.num_envs
        numbers = [whole.joint_names.index(joint) for joint in joint_names]
        start = numbers[0] if numbers else 0
        consecutive = numbers == list(range(start, start + len(numbers)))
        self.columns: slice | np.ndarray = slice(start, start + len(numbers)) if consecutive else np.array(numbers)
        self.joints = tuple(whole.joints[number] for number in numbers)
        self.joint_names, self.dof = tuple(joint_names), len(numbers)
        self.tcp = tcp or whole.tcp
        self.frame_name("tcp")
        for limit in ("home", "position_lower", "position_upper", "velocity_limit", "effort_limit"):
            setattr(self, limit, getattr(whole, limit)[:, self.columns])

    @property
    def joint_positions(self) -> Floats:
        """(num_envs, dof) [rad or m]."""
        return self._whole.joint_positions[:, self.columns]

    @property
    def joint_velocities(self) -> Floats:
        """(num_envs, dof) [rad/s or m/s]."""
        return self._whole.joint_velocities[:, self.columns]

    @property
    def joint_efforts(self) -> Floats:
        """Efforts that the drives applied in the last physics step, (num_envs, dof) [N·m or N]."""
        return self._whole.joint_efforts[:, self.columns]

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        """pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4) of the robot's root link in the world."""
        return self._whole.base_pose

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (num_envs, 3) [m/s] and ang_vel_world (num_envs, 3) [rad/s] of the root link's origin."""
        return self._whole.base_twist

    def drive_gains(self) -> tuple[Floats, Floats]:
        """Return Kp and Kd, (num_envs, dof) each."""
        stiffness, damping = self._whole.drive_gains()
        return stiffness[:, self.columns], damping[:, self.columns]

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        """Return the pose of a link in the world, at the current or given positions of the group's joints."""
        whole = self._whole
        if joint_positions is None:
            return whole.frame_pose(self.frame_name(frame))
        positions = np.repeat(whole.home[:1], len(joint_positions), axis=0)
        positions[:, self.columns] = joint_positions
        return whole.frame_pose(self.frame_name(frame), positions)

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        """Return lin_vel_world [m/s] and ang_vel_world [rad/s] of a link's origin, (num_envs, 3) each."""
        return self._whole.frame_velocity(self.frame_name(frame))

    def frame_jacobian(self, frame: str) -> Floats:
        """Return (num_envs, 6, dof) for the group's joints."""
        return self._whole.frame_jacobian(self.frame_name(frame))[:, :, self.columns]
