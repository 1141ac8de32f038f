"""Descriptions of robots as data. A robot's limits, inertia and geometry are read from its model file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import cast

from frobs_core.deprecation import deprecated
from frobs_core.description.camera import Camera
from frobs_core.description.sensor import Lidar, Sensor
from frobs_core.models.defaults import DriveGains
from frobs_core.models.load import find_reader, load_model
from frobs_core.models.model import RobotModel

ALL = "all"
"""Name of the only joint group of a robot that does not define groups."""


class CommandMode(StrEnum):
    """Quantity that a joint command specifies as the target of the drive law."""

    POSITION = "position"
    VELOCITY = "velocity"
    EFFORT = "effort"


@dataclass(frozen=True, kw_only=True)
class DifferentialDrive:
    """Wheels and limits of a differential drive.

    Attributes:
        left: Joints of the left wheels.
        right: Joints of the right wheels.
        separation: Distance between the left and right contact points [m].
        wheel_radius: Radius of the wheels [m].
        max_linear_velocity: Maximum linear velocity [m/s].
        max_angular_velocity: Maximum angular velocity [rad/s].
        max_linear_acceleration: Maximum linear acceleration [m/s²], or None for no limit.
        max_angular_acceleration: Maximum angular acceleration [rad/s²], or None for no limit.
    """

    left: tuple[str, ...]
    right: tuple[str, ...]
    separation: float
    wheel_radius: float
    max_linear_velocity: float
    max_angular_velocity: float
    max_linear_acceleration: float | None = None
    max_angular_acceleration: float | None = None


@dataclass(frozen=True, kw_only=True)
class EndEffector:
    """A tool at the end of an arm.

    Attributes:
        tcp: Link that is the tool center point.
        arm: Joint group that carries the tool, or empty for the robot's first group.
        group: Joint group of the fingers, or empty if the tool has no joints.
        open: Joint positions of the open tool, by joint name [rad or m].
        closed: Joint positions of the closed tool, by joint name [rad or m].
        gap: Distances between the pads of the closed and the open gripper [m], or None if unknown.
        has_fixed_jaw: Whether one of the pads does not move.
    """

    tcp: str
    arm: str = ""
    group: str = ""
    open: Mapping[str, float] = field(default_factory=dict)
    closed: Mapping[str, float] = field(default_factory=dict)
    gap: tuple[float, float] | None = None
    has_fixed_jaw: bool = False

    @property
    def is_gripper(self) -> bool:
        """Whether the end effector has fingers that open and close."""
        return bool(self.group and self.closed)


@dataclass(frozen=True, kw_only=True)
class Robot:
    """Description of a robot as data.

    Attributes:
        model: Path of the model file, or ``"package:folder/file.urdf.xacro"`` for a file in an installed package. The
            suffix determines the format: ``.urdf``, ``.xacro`` or ``.xml`` (MJCF).
        name: Name for messages.
        xacro_args: Arguments of the xacro file.
        package_paths: Folders of the ROS packages that the model file refers to, by package name.
        home: Rest configuration by joint name [rad or m]. Omitted joints rest at 0, or at the middle of their limits if
            the limits exclude 0.
        tcp: Link that serves as the tool center point, or None for the last link of the longest chain.
        gains: Gains of the drive law. If None, critically damped gains are computed from the robot's inertia.
        base: ``"fixed"`` for a base that cannot move, or ``"floating"`` or ``"wheeled"`` for a base that moves freely.
        sensors: Sensors, by name.
        differential_drive: Differential drive of the robot, or None if the robot has no such drive.
        self_collision: Whether non-adjacent links collide with each other.
        friction: Coefficient of sliding friction by link, for links that should not use the simulator's default, such
            as 0 for a caster.
        armature: Inertia of the motors, reflected through the gears, by joint name [kg·m² or kg]. This inertia replaces
            the value in the model file. URDF files cannot contain it.
        groups: Names of the joints that are controlled together, by group name. If empty, all joints form the group
            ``"all"``. Groups must not overlap. Joints that are not in a group hold their home position.
        default_controllers: Names of the controllers to use if the user does not choose any, by joint group.
        end_effectors: Tools, by name.
        cameras: Cameras on the robot's links, by name. The ``frame`` of each is a link.
    """

    model: str
    name: str = "robot"
    xacro_args: Mapping[str, str] = field(default_factory=dict)
    package_paths: Mapping[str, str] = field(default_factory=dict)
    home: Mapping[str, float] = field(default_factory=dict)
    tcp: str | None = None
    gains: DriveGains | None = None
    base: str = "fixed"
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    differential_drive: DifferentialDrive | None = None
    self_collision: bool = True
    friction: Mapping[str, float] = field(default_factory=dict)
    armature: Mapping[str, float] = field(default_factory=dict)
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    default_controllers: Mapping[str, str] = field(default_factory=dict)
    end_effectors: Mapping[str, EndEffector] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(default_factory=dict)

    def end_effector_of(self, group: str = "") -> EndEffector | None:
        """Return the first end effector that a joint group carries or moves, or None.

        Args:
            group: Name of the joint group. If empty, the first gripper of the robot is returned, or its first end
                effector if it has no gripper.
        """
        first, tools = next(iter(self.groups), ""), list(self.end_effectors.values())
        if group:
            return next((tool for tool in tools if group in (tool.arm or first, tool.group)), None)
        return next((tool for tool in tools if tool.is_gripper), tools[0] if tools else None)

    @deprecated(instead="RobotHandle.group(joint_names, name=group).tcp", since="0.3", removed_in="0.4")
    def tcp_of(self, group: str) -> str | None:
        """Return the tool center point of a joint group, or None if the group uses the robot's tool center point."""
        first = next(iter(self.groups), "")
        return next((tool.tcp for tool in self.end_effectors.values() if (tool.arm or first) == group), None)

    def attach(
        self,
        link: str,
        tool: Robot,
        *,
        name: str = "gripper",
        pos: tuple[float, float, float] = (0.0, 0.0, 0.0),
        rpy: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> Robot:
        """Return a copy of this arm with an end effector attached to one of its links.

        Both models are merged into one cached URDF, in which all of the tool's names begin with ``name_``. The
        tool's joints become the joint group ``name``. If the arm has no groups, its joints become the group ``"arm"``.
        The combined robot uses the tool's tool center point.

        Args:
            link: Link that carries the tool.
            tool: Description of the tool as a robot without joint groups. If the description includes an end effector,
                that end effector defines the tool center point and the open and closed positions.
            name: Name of the end effector and its joint group, and prefix for all names in the tool's model.
            pos: Position of the tool's root link relative to ``link`` [m].
            rpy: Orientation of the tool's root link relative to ``link`` [rad].

        Raises:
            UnknownNameError: The arm has no link with this name.
            UnsuitableRobotError: A model is not a URDF, the tool has joint groups, or the name is already used.
            ModelFileError: A model cannot be read.
        """
        return cast(Robot, find_reader(self.model).attach(self, link, tool, name, pos, rpy))

    def read_model(self) -> RobotModel:
        """Read the model file. For errors, see :func:`frobs_core.models.load_model`."""
        return load_model(self.model, xacro_args=self.xacro_args, package_paths=self.package_paths)

    @cached_property
    def lidars(self) -> Mapping[str, Lidar]:
        """The robot's lidars, by name."""
        return {name: sensor for name, sensor in self.sensors.items() if isinstance(sensor, Lidar)}
