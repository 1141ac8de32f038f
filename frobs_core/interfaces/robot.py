"""A robot: data. Limits, inertia and geometry are read from its model file, never repeated here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from frobs_core.interfaces.sensor import Lidar, Sensor

ALL = "all"
"""Name of the only joint group of a robot that defines none."""


@dataclass(frozen=True, kw_only=True)
class DriveGains:
    """Gains of the drive law, one number for all joints or one by joint name.

    Attributes:
        stiffness: Kp [N·m/rad or N/m]
        damping: Kd [N·m·s/rad or N·s/m]
    """

    stiffness: float | Mapping[str, float]
    damping: float | Mapping[str, float]

    def of(self, joint: str) -> tuple[float, float]:
        """Return (Kp, Kd) of one joint; a joint that a mapping leaves out has 0."""

        def pick(gain: float | Mapping[str, float]) -> float:
            return gain.get(joint, 0.0) if isinstance(gain, Mapping) else gain

        return pick(self.stiffness), pick(self.damping)


@dataclass(frozen=True, kw_only=True)
class DifferentialDrive:
    """Two driven wheels on one axis.

    Attributes:
        left: Joints of the left wheels.
        right: Joints of the right wheels.
        separation: Between left and right contact points [m].
        wheel_radius: [m]
        max_linear_velocity: [m/s]
        max_angular_velocity: [rad/s]
        max_linear_acceleration: [m/s²]; None: velocities jump.
        max_angular_acceleration: [rad/s²]; None: velocities jump.
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
        arm: Joint group that carries it; empty: the robot's first group.
        group: Joint group of its fingers; empty: it has none.
        open: Joint positions at which it is open, by joint name [rad or m].
        closed: Joint positions at which it is closed, by joint name [rad or m].
    """

    tcp: str
    arm: str = ""
    group: str = ""
    open: Mapping[str, float] = field(default_factory=dict)
    closed: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Robot:
    """A robot, as data.

    Attributes:
        model: ``"package:folder/file.urdf.xacro"`` inside an installed package, or a path.
            The ending says the format: ``.urdf``, ``.xacro`` or ``.xml`` (MJCF).
        name: For messages.
        xacro_args: Arguments of the xacro file.
        package_paths: Folders of the ROS packages that the file names, by package name.
        home: Rest configuration by joint name [rad or m]; a joint that is left out rests at 0, or at the
            middle of its limits where 0 is outside of them.
        tcp: Link that a task talks about; None: the last link of the longest chain.
        gains: Of the drive law; None: computed from the inertia, critically damped.
        base: ``"fixed"``, ``"floating"`` or ``"wheeled"``; the last two move freely in the world.
        sensors: By name.
        differential_drive: For wheeled robots that turn by it.
        self_collision: Whether links collide that are not neighbours.
        friction: Sliding friction coefficient of links that do not have the simulators' own, by link: 0 for what
            glides, as a caster does.
        groups: Joints that are controlled together, by group name; empty: one group, ``"all"``. Groups are disjoint.
            Joints in no group hold their home position.
        default_controllers: Controller of each group, for groups whose controller the user does not choose.
        end_effectors: Tools, by name.
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
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    default_controllers: Mapping[str, str] = field(default_factory=dict)
    end_effectors: Mapping[str, EndEffector] = field(default_factory=dict)

    def tcp_of(self, group: str) -> str | None:
        """Return the link that is the tool center point of a joint group; None: the robot's own."""
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
        """Return this arm with an end effector at one of its links.

        The models of both become one URDF in the cache, in which all names of the tool begin with ``name_``. The tool's
        joints become the joint group ``name``, and the arm's joints the group ``"arm"`` if it had no groups. The tool
        center point is the tool's.

        Args:
            link: Link that carries the tool.
            tool: Description of the tool: a robot without joint groups. Its end effector, if it describes one, states the
                tool center point and the open and closed positions.
            name: Name of the end effector, of its joint group, and prefix of all its names.
            pos: Of the tool's root link in ``link`` [m].
            rpy: Orientation of the tool's root link in ``link`` [rad].

        Raises:
            UnknownNameError: The arm has no such link.
            UnsuitableRobotError: A model is no URDF, the tool has joint groups, or the name is taken.
            ModelFileError: A model cannot be read.
        """
        from frobs_core.interfaces.attachment import attach  # which reads model files

        return attach(self, link, tool, name, pos, rpy)

    @cached_property
    def lidars(self) -> Mapping[str, Lidar]:
        """Those of the sensors that are lidars."""
        return {name: sensor for name, sensor in self.sensors.items() if isinstance(sensor, Lidar)}
