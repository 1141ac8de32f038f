"""Configuration of one robot in an environment: its description, changes to the description, and its controllers."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from pathlib import Path
from typing import Any

from frobs_core import plugins
from frobs_core.deprecation import rename_keywords
from frobs_core.description import ALL, DifferentialDrive, Robot
from frobs_core.kernel.robot_file import device_and_link, is_robot_file, read_robot_file
from frobs_core.models import (
    Pose,
    RobotModel,
    compose,
    default_tcp,
    home_positions,
    pose_array,
    pose_from_array,
)
from frobs_core.models.load import find_reader
from frobs_core.plugins.records import AnyRecord, ControllerDefaults, ControllerRecord, Record
from frobs_core.sensing.sensors.settings import apply_settings
from frobs_core.util.errors import MissingSettingError, ParameterValueError, check_keys, check_name
from frobs_core.util.rotations import quat_from_rpy
from frobs_core.util.validation import check_fields, check_types, choice, number_list, positive

RENAMED_KEYWORDS = {"robot_args": "xacro_args"}
"""New names of keywords of version 0.2."""

BASES = ("fixed", "floating", "wheeled")

_NEAR = 0.005  # [m] height above the lowest point; links below this height touch the floor
_TOUCHING = 1e-3  # [m] distance from the floor; bases within this distance are not moved
_SUFFIX = re.compile(r"\.\w+$")  # names of records contain no dot, so a name that ends like this is the path of a file


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotKeywords:
    """Keywords of one robot, which an environment with a single robot accepts as its own.

    Args:
        robot: Name of the robot, path of a URDF, xacro or MJCF file, path of a YAML file with keywords of this class
            (:mod:`frobs_core.kernel.robot_file`), or a robot description. ``"ARM+TOOL"`` attaches a named tool to the
            tool center point of an arm, for example ``"irb120+parallel_gripper"``.
        controller: Name or record of the controller for the robot's first joint group, or a mapping from joint groups
            to controllers. In the mapping, None leaves a group without a controller. Omitted groups use the robot's
            default controllers.
        controller_kwargs: Keywords of the controller. If ``controller`` is a mapping, ``controller_kwargs`` maps joint
            groups to keywords.
        xacro_args: Arguments for the robot's xacro file.
        package_paths: Folders of the ROS packages that the robot's model file refers to, by package name.
        home: Rest positions by joint name [rad or m]. Omitted joints keep the robot's default.
        tcp: Link that serves as the tool center point, or None for the robot's default.
        gripper: Known properties of the gripper of a model file: names of the joints that move its fingers, or a mapping
            with ``joints``, ``arm``, ``palm``, ``pads``, ``fixed_jaw``, ``tcp`` (``{"pos": [x, y, z], "rpy": [roll,
            pitch, yaw]}`` relative to the palm), ``open``, ``closed``, ``gap``, ``levers`` and ``controller`` [m, rad].
            The rest is found in the file. ``frobs doctor robot FILE --write robot.yaml`` writes all of them.
        attach: Gripper to mount on the arm: a robot's name, the path of a model file, ``"GRIPPER@LINK"``, or a mapping
            with ``robot``, ``link``, ``pos`` [m] and ``rpy`` [rad]. The link that carries it defaults to the arm's tool
            center point, or else to the last link.
        sensors: Overrides of sensor settings, by sensor name, for example ``{"lidar": {"rays": 36, "noise": 0.01}}``;
            see :mod:`frobs_core.sensing.sensors`.
        base: Type of the robot's base: ``"fixed"``, ``"floating"`` if the root link moves freely, or ``"wheeled"`` if
            it moves on wheels. Defaults to the robot's base type.
        differential_drive: Differential drive of a robot whose description does not define one, as a mapping with the
            fields of :class:`~frobs_core.description.DifferentialDrive`, for example ``{"left": ["wheel_l"], "right":
            ["wheel_r"], "separation": 0.3, "wheel_radius": 0.05, "max_linear_velocity": 0.5, "max_angular_velocity":
            2.0}`` [m, m/s, rad/s]. With this setting, the base is wheeled, and all links on the floor except the wheels
            slide without friction.

    Raises:
        ConfigurationError: A value has the wrong type.
    """

    robot: str | Robot = ""
    controller: str | ControllerRecord | Mapping[str, str | ControllerRecord | None] = ""
    controller_kwargs: Mapping[str, Any] = field(default_factory=dict)
    xacro_args: Mapping[str, str] = field(default_factory=dict)
    package_paths: Mapping[str, str] = field(default_factory=dict)
    home: Mapping[str, float] = field(default_factory=dict)
    tcp: str | None = None
    gripper: Mapping[str, Any] | Sequence[str] = field(default_factory=dict)
    attach: str | Mapping[str, Any] | None = None
    sensors: Mapping[str, Any] | None = None
    base: str | None = None
    differential_drive: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        for name in ("robot", "attach"):
            if isinstance(path := getattr(self, name), os.PathLike):
                object.__setattr__(self, name, os.fspath(path))
        object.__setattr__(self, "gripper", _gripper_settings(self.gripper))
        if is_robot_file(self.robot):
            from frobs_core.util.yaml import merge  # imports PyYAML

            for name, value in read_robot_file(str(self.robot)).items():
                value, chosen = _gripper_settings(value) if name == "gripper" else value, getattr(self, name)
                if isinstance(value, Mapping) and isinstance(chosen, Mapping):
                    object.__setattr__(self, name, merge(value, chosen))
                elif name == "robot" or not chosen:
                    object.__setattr__(self, name, value)
        rule = "a name, a ControllerRecord or a mapping from joint groups to controllers"
        check_types(
            self,
            robot=(str | Robot, "a name, the path of a model file or a Robot"),
            controller=(str | ControllerRecord | Mapping, rule),
            gripper=(Mapping, "names of joints, or a mapping"),
            attach=(str | Mapping | None, "the name or the file of a gripper, or a mapping"),
        )
        for joint, position in self.home.items():
            if not isinstance(position, Real) or isinstance(position, bool):
                raise ParameterValueError(f"home of joint '{joint}'", position, "a number [rad or m]")
        if isinstance(self.controller_kwargs, ControllerDefaults):
            object.__setattr__(self, "controller_kwargs", self.controller_kwargs.of(self.controller))


@dataclass(frozen=True, kw_only=True)
class RobotConfig(RobotKeywords):
    """Configuration of one robot in an environment: its :class:`RobotKeywords` and its pose.

    Args:
        pose: Base pose in the world frame, ``{"pos": [x, y, z], "rpy": [roll, pitch, yaw]}`` [m, rad]. Defaults to the
            task's pose.
    """

    pose: Mapping[str, Any] | None = None

    @classmethod
    def from_value(cls, name: str, value: Any, defaults: Mapping[str, Any]) -> RobotConfig:
        """Return the configuration for one entry of an environment's ``robots``.

        Args:
            name: Name of the robot in the environment.
            value: Name of a robot, path of a model file, a robot description, or a mapping with the fields of this
                class.
            defaults: Values for fields that the entry does not set.

        Raises:
            UnknownParameterError: The mapping has an unknown key.
            ParameterValueError: The value has the wrong type.
        """
        if isinstance(value, str | Robot):
            value = {"robot": value}
        if not isinstance(value, Mapping):
            raise ParameterValueError(f"robots.{name}", value, "the name of a robot, or a mapping of settings")
        value = rename_keywords(value, RENAMED_KEYWORDS)
        check_keys(f"robots.{name}", value, [item.name for item in fields(cls)])
        return cls(**{**defaults, **value})

    @property
    def is_file(self) -> bool:
        """Whether the robot is described by its model file alone."""
        return isinstance(self.robot, str) and _SUFFIX.search(self.robot) is not None

    @property
    def from_file(self) -> bool:
        """Whether the robot, or the gripper that is attached to it, is described by its model file alone."""
        attached = (
            self.attach.get("robot") if isinstance(self.attach, Mapping) else device_and_link(self.attach or "")[0]
        )
        return self.is_file or _SUFFIX.search(str(attached)) is not None

    def describe(self) -> Robot:
        """Return the robot description with all changes of this configuration.

        Raises:
            UnknownNameError: No plugin provides the robot, or ``sensors`` names a sensor that the robot does not have.
            MissingSettingError: The robot is missing.
            ConfigurationError: A sensor setting cannot be used.
        """
        description = _look_up(self.robot, self.xacro_args, self.package_paths)
        if self.attach:
            description = _attached(description, self.attach, self.package_paths)
        changes: dict[str, Any] = {} if self.tcp is None else {"tcp": self.tcp}
        if self.home:
            changes["home"] = {**description.home, **self.home}
        if self.differential_drive is not None:
            changes |= {"differential_drive": self._drive(), "base": "wheeled"}
        if self.base is not None:
            changes["base"] = choice("base", self.base, BASES)
        if self.sensors:
            changes["sensors"] = apply_settings(description.sensors, self.sensors)
        return replace(description, **changes)

    def _drive(self) -> DifferentialDrive:
        given = dict(self.differential_drive or {})
        check_fields("differential_drive", DifferentialDrive, given)
        for key, value in given.items():
            if key not in ("left", "right"):
                given[key] = positive(f"differential_drive.{key}", value)
                continue
            given[key] = names = (
                (value,) if isinstance(value, str) else tuple(value) if isinstance(value, list | tuple) else ()
            )
            if not names or not all(isinstance(name, str) for name in names):
                raise ParameterValueError(f"differential_drive.{key}", value, "the name of a joint, or a list of names")
        return DifferentialDrive(**given)

    def place(self, robot: Robot, model: RobotModel, pose: Pose, *, on_floor: bool) -> tuple[Robot, Pose]:
        """Return the robot description adapted to the scene, and the base pose in the world frame.

        If this configuration does not set ``pose``, a movable base starts at the root pose defined by its model file,
        relative to the base pose that the task defines. If there is a floor, the base is moved vertically so that its
        lowest point touches the floor.

        Args:
            robot: Description of the robot.
            model: Model of the robot.
            pose: Base pose that the task defines.
            on_floor: Whether there is a floor at z = 0.

        Raises:
            ConfigurationError: See :meth:`base_pose`.
            UnknownNameError: A wheel is not an actuated joint.
        """
        pose = self.base_pose(pose)
        if robot.base == "fixed":
            return robot, pose
        if self.pose is None and model.root_pose != Pose():
            pose = pose_from_array(compose(pose_array(pose), pose_array(model.root_pose)))
        heights = find_reader(model.path).lowest_points(model, home_positions(model, robot.home), pose.quat_wxyz)
        lowest = min(heights.values(), default=math.inf)
        if self.differential_drive is not None and robot.differential_drive is not None:
            wheels = _links_of_wheels(robot.name, robot.differential_drive, model)
            standing = [link for link, height in heights.items() if height < lowest + _NEAR]
            gliding = {link: 0.0 for link in standing if link not in wheels}
            robot = replace(robot, friction=gliding | dict(robot.friction))
        if self.pose is None and on_floor and heights and abs(pose.pos[2] + lowest) > _TOUCHING:
            pose = replace(pose, pos=(*pose.pos[:2], -lowest))
        return robot, pose

    def controllers(self, robot: Robot) -> dict[str, tuple[ControllerRecord, Mapping[str, Any]]]:
        """Return the controller record and keywords of each joint group, in the order of the groups.

        Args:
            robot: Description of the robot.

        Raises:
            UnknownNameError: A controller or joint group does not exist.
            MissingSettingError: No group has a controller, or a group has keywords but no controller.
            ParameterValueError: The keywords of a group are not a mapping.
        """
        groups = list(robot.groups) or [ALL]
        chosen: dict[str, str | ControllerRecord | None] = dict(robot.default_controllers)
        if isinstance(self.controller, Mapping):
            chosen |= self.controller
            keywords: Mapping[str, Mapping[str, Any]] = self.controller_kwargs
        else:
            if self.controller:
                chosen[groups[0]] = self.controller
            keywords = {groups[0]: self.controller_kwargs}
        for group in (*chosen, *keywords):
            check_name(f"joint group of robot '{robot.name}'", group, groups)
        found = {}
        for group in groups:
            own = keywords.get(group) or {}
            if not isinstance(own, Mapping):
                raise ParameterValueError(f"controller_kwargs.{group}", own, "a mapping of parameters to values")
            if part := chosen.get(group):
                found[group] = find_record(ControllerRecord, part), own
            elif own:
                advice = f"choose one with controller={{'{group}': …}}, or remove its controller_kwargs"
                raise MissingSettingError(f"joint group '{group}' of robot '{robot.name}'", "a controller", advice)
        if not found:
            raise MissingSettingError(f"robot '{robot.name}'", "a controller", "pass controller='joint_delta_position'")
        return found

    def base_pose(self, default: Pose) -> Pose:
        """Return the base pose in the world frame.

        Raises:
            UnknownParameterError: ``pose`` has a key that is neither ``pos`` nor ``rpy``.
            ParameterValueError: A value in ``pose`` does not consist of three finite numbers.
        """
        if self.pose is None:
            return default
        check_keys("pose", self.pose, ("pos", "rpy"))
        x, y, z = number_list("pose.pos", self.pose.get("pos", (0.0, 0.0, 0.0)), 3)
        a, b, c, d = quat_from_rpy(number_list("pose.rpy", self.pose.get("rpy", (0.0, 0.0, 0.0)), 3)).tolist()
        return Pose((x, y, z), (a, b, c, d))


def _gripper_settings(gripper: Any) -> Any:
    """Return what is known about a gripper as a mapping, if it is stated by the names of its joints."""
    if not isinstance(gripper, str | list | tuple):
        return gripper
    joints = gripper.split(",") if isinstance(gripper, str) else gripper
    return {"joints": [str(joint).strip() for joint in joints]} if joints else {}


def _look_up(robot: str | Robot, xacro_args: Mapping[str, str], package_paths: Mapping[str, str]) -> Robot:
    """Return the description of a robot, to whose model file the arguments and the folders are passed.

    For ``"ARM+TOOL"``, the arguments belong to the arm's file, and the folders to both files.
    """
    is_name = isinstance(robot, str) and not _SUFFIX.search(robot)
    arm_name, _, tool_name = str(robot).rpartition("+") if is_name else ("", "", "")
    if arm_name:
        arm, tool = _look_up(arm_name, xacro_args, package_paths), _look_up(tool_name, {}, package_paths)
        return arm.attach(arm.tcp or default_tcp(arm.read_model()), tool)
    named = _named(robot)
    return replace(
        named,
        xacro_args={**named.xacro_args, **xacro_args},
        package_paths={**named.package_paths, **package_paths},
    )


def _attached(arm: Robot, attach: str | Mapping[str, Any], package_paths: Mapping[str, str]) -> Robot:
    """Return an arm with a gripper. The gripper of a model file is not described: it is found like that of an arm."""
    settings: Mapping[str, Any] = (
        attach if isinstance(attach, Mapping) else dict(zip(("robot", "link"), device_and_link(attach), strict=True))
    )
    check_keys("attach", settings, ("robot", "link", "pos", "rpy"))
    name = str(settings.get("robot", ""))
    pose = {key: number_list(f"attach.{key}", settings[key], 3) for key in ("pos", "rpy") if key in settings}
    link = settings.get("link") or arm.tcp or default_tcp(arm.read_model())
    joined = arm.attach(str(link), _look_up(name, {}, package_paths), **pose)  # type: ignore[arg-type]
    if not _SUFFIX.search(name):
        return joined
    return replace(joined, groups={}, end_effectors={}, default_controllers=arm.default_controllers, tcp=None)


def _named(robot: str | Robot) -> Robot:
    if isinstance(robot, Robot):
        return robot
    if not robot:
        known = ", ".join(f"'{name}'" for name in plugins.records("robot")) or "none"
        raise MissingSettingError(
            "this environment",
            "a robot",
            "pass a model file, such as robot='path/to/arm.urdf' (or .urdf.xacro, or .xml for MJCF) and tcp='LINK', "
            f"or the name of an installed robot: {known}",
        )
    if _SUFFIX.search(robot):
        return Robot(model=robot, name=Path(robot).name.partition(".")[0])
    found: Robot = plugins.get_record("robot", robot).load()
    return found


def _links_of_wheels(robot: str, drive: DifferentialDrive, model: RobotModel) -> list[str]:
    driven = {*drive.left, *drive.right}
    for wheel in driven:
        check_name(f"actuated joint of '{robot}'", wheel, model.joint_names)
    return [joint.child for joint in model.joints if joint.name in driven]


def find_record(cls: type[AnyRecord], part: str | Record) -> AnyRecord:
    """Return a record of a class by its name. A record is returned unchanged.

    Raises:
        UnknownNameError: No plugin provides the name.
        ParameterValueError: ``part`` is neither a name nor a record of this class.
    """
    record = plugins.get_record(cls.kind, part) if isinstance(part, str) else part
    if not isinstance(record, cls):
        raise ParameterValueError(cls.kind, part, f"a name or a {cls.__name__}")
    return record
