"""Environment configuration, which contains all keywords that ``gym.make(id, ...)`` accepts."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from numbers import Real
from typing import Any

import numpy as np

from frobs_core.description import Robot
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.plugins.records import ControllerDefaults, ControllerRecord, SimulatorRecord, TaskRecord
from frobs_core.util.errors import (
    ConfigurationError,
    ConflictingOptionsError,
    MissingSettingError,
    ParameterValueError,
)
from frobs_core.util.validation import choice, whole_number

RENDER_MODES = ("rgb_array", "human")

MAX_THREADS = 1_024
"""Maximum number of threads or worker processes of a simulator."""

MAX_SIDE = 16_384
"""Maximum height and width of a rendered image [pixels]. A graphics card may support less."""

_OF_A_ROBOT = (
    *("robot", "controller", "controller_kwargs", "robot_args", "package_paths", "home", "tcp", "sensors"),
    *("base", "differential_drive"),
)
"""Fields that configure a single robot."""

_MAPPINGS = (
    "controller_kwargs",
    "simulator_kwargs",
    "robot_args",
    "package_paths",
    "home",
    "observations",
    "cameras",
    "task_parameters",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class EnvConfig:
    """Keywords of an environment.

    :meth:`from_dict` and :meth:`to_dict` convert between a configuration and the flat keywords of ``gymnasium.make``,
    which include the task's parameters.

    Args:
        task: Name of the task, or a task record.
        robot: Name of the robot, path of a URDF, xacro or MJCF file, or a robot description. ``"ARM+TOOL"`` attaches a
            named tool to the tool center point of an arm, for example ``"irb120+parallel_gripper"``.
        robots: Configurations of several robots by name, instead of ``robot``. Each value is a robot's name or a
            mapping with the fields of :class:`frobs_core.kernel.robot_config.RobotConfig`, for example ``{"left": "irb120",
            "right": {"robot": "ur5", "controller": "joint_position"}}``. An entry that omits ``controller`` or
            ``controller_kwargs`` uses the environment's value of that field.
        controller: Name of the controller, a controller record, or a mapping from joint groups to controllers; see
            :class:`frobs_core.kernel.robot_config.RobotConfig`.
        simulator: Name of the simulator, or a simulator record.
        reward_type: One of the task's reward types, or None for the first reward type.
        render_mode: ``"rgb_array"``, ``"human"`` or None.
        camera: Camera that ``render`` uses, or None for the scene's first camera.
        render_size: Size of rendered images, (height, width) [pixels].
        control_timestep: Time between two actions [s]. Defaults to the controller's timestep, or to the task's timestep
            if the controller does not define a timestep.
        physics_timestep: Duration of one engine step [s], or None for the task's default.
        controller_kwargs: Keywords of the controller. If ``controller`` is a mapping, ``controller_kwargs`` maps joint
            groups to keywords.
        simulator_kwargs: Keywords of the simulator, such as the solver. ``frobs show simulator:NAME`` lists the
            keywords.
        robot_args: Arguments for the robot's xacro file.
        package_paths: Folders of the ROS packages that the robot's model file refers to, by package name.
        home: Rest positions by joint name [rad or m]. Omitted joints keep the robot's default.
        tcp: Link that serves as the tool center point, or None for the robot's default.
        sensors: Overrides of sensor settings, by sensor name, for example ``{"lidar": {"rays": 36, "noise": 0.01}}``;
            see :mod:`frobs_core.sensing.sensors`.
        base: Type of the robot's base: ``"fixed"``, ``"floating"`` if the root link moves freely, or ``"wheeled"`` if
            it moves on wheels. Defaults to the robot's base type.
        differential_drive: Differential drive of a robot whose description does not define one, for example ``{"left":
            ["wheel_l"], "right": ["wheel_r"], "separation": 0.3, "wheel_radius": 0.05, "max_linear_velocity": 0.5,
            "max_angular_velocity": 2.0}`` [m, m/s, rad/s].
        observations: Observation terms to add to the task's terms, by name, for example ``{"joints": {"type":
            "joint_efforts"}, "wrist": {"camera": "overview", "size": [84, 84]}}``; see :mod:`frobs_core.kernel.added_terms`. A
            value of None drops the task's term with that name, and ``{"*": None}`` drops all task terms except goals.
        cameras: Cameras to add to the task's scene, by name, for example ``{"wrist": {"robot": "robot", "link": "tool0",
            "pos": [0, 0.05, 0], "target": [0, 0, 0.2], "fov_y": 60}}`` [m, deg]. A camera is fixed to a ``link`` of a
            robot (by default the first), to a ``body`` of the scene, or else in the world. Optional settings are
            ``up``, and ``intrinsics`` instead of ``fov_y``; see :class:`frobs_core.description.Camera`. If the scene
            already has a camera with this name, only the given settings change.
        num_threads: Number of engine threads, or 0 for one thread per processor.
        randomize: Domain randomization settings; see :mod:`frobs_core.sensing.randomization`.
        task_parameters: Keywords of the task.

    Raises:
        ConfigurationError: A value has the wrong type.
    """

    task: str | TaskRecord
    robot: str | Robot = ""
    controller: str | ControllerRecord | Mapping[str, str | ControllerRecord | None] = ""
    robots: Mapping[str, Any] | None = None
    simulator: str | SimulatorRecord = "mujoco"
    reward_type: str | None = None
    render_mode: str | None = None
    camera: str | None = None
    render_size: tuple[int, int] = (480, 640)
    control_timestep: float | None = None
    physics_timestep: float | None = None
    controller_kwargs: Mapping[str, Any] = field(default_factory=dict)
    simulator_kwargs: Mapping[str, Any] = field(default_factory=dict)
    robot_args: Mapping[str, str] = field(default_factory=dict)
    package_paths: Mapping[str, str] = field(default_factory=dict)
    home: Mapping[str, float] = field(default_factory=dict)
    tcp: str | None = None
    sensors: Mapping[str, Any] | None = None
    base: str | None = None
    differential_drive: Mapping[str, Any] | None = None
    observations: Mapping[str, Any] = field(default_factory=dict)
    cameras: Mapping[str, Any] = field(default_factory=dict)
    num_threads: int = 0
    randomize: Mapping[str, Any] | None = None
    task_parameters: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in _MAPPINGS:
            if getattr(self, name) is None:
                object.__setattr__(self, name, {})
        _check(self, (str, TaskRecord), "a name or a TaskRecord", "task")
        _check(self, (str, Robot), "a name, the path of a model file or a Robot", "robot")
        _check(
            self,
            (str, ControllerRecord, Mapping),
            "a name, a ControllerRecord or a mapping from joint groups to controllers",
            "controller",
        )
        _check(self, (str, SimulatorRecord), "a name or a SimulatorRecord", "simulator")
        _check(self, (str, type(None)), "a name or None", "reward_type", "camera", "tcp", "base")
        _check(self, (Real, type(None)), "a number of seconds or None", "control_timestep", "physics_timestep")
        _check(self, (Mapping, type(None)), "a mapping or None", "sensors", "randomize", "robots", "differential_drive")
        _check(self, Mapping, "a mapping", *_MAPPINGS)
        if isinstance(self.controller_kwargs, ControllerDefaults):
            object.__setattr__(self, "controller_kwargs", self.controller_kwargs.of(self.controller))
        whole_number("num_threads", self.num_threads, highest=MAX_THREADS)
        if self.render_mode is not None:
            choice("render_mode", self.render_mode, RENDER_MODES)
        for name in (*_MAPPINGS, "sensors", "randomize", "robots", "differential_drive"):
            if not all(isinstance(key, str) for key in getattr(self, name) or ()):
                raise ParameterValueError(name, getattr(self, name), "a mapping whose keys are strings")
        for joint, position in self.home.items():
            if not isinstance(position, Real) or isinstance(position, bool):
                raise ParameterValueError(f"home of joint '{joint}'", position, "a number [rad or m]")
        size = tuple(self.render_size) if isinstance(self.render_size, Iterable) else ()
        if len(size) != 2 or not all(isinstance(side, int | np.integer) and 0 < side <= MAX_SIDE for side in size):
            raise ParameterValueError("render_size", self.render_size, f"(height, width) in pixels, up to {MAX_SIDE:,}")
        object.__setattr__(self, "render_size", size)

    @classmethod
    def from_dict(cls, keywords: Mapping[str, Any]) -> EnvConfig:
        """Create a configuration from flat keywords. Keywords that are not fields become task parameters.

        Raises:
            ConfigurationError: A value has the wrong type.
            MissingSettingError: ``task`` is missing.
        """
        if "task" not in keywords:
            raise MissingSettingError("this environment", "a task", "pass it as task='…'")
        own = {name: value for name, value in keywords.items() if name in KEYWORDS}
        return cls(**own, task_parameters={name: keywords[name] for name in keywords if name not in KEYWORDS})

    def robot_configs(self) -> dict[str, RobotConfig]:
        """Return the configuration of each controlled robot, by name. A single robot is named ``"robot"``.

        Raises:
            ConflictingOptionsError: Both ``robot`` and ``robots`` are given, or ``robots`` is combined with a setting
                for a single robot.
            ConfigurationError: An entry of ``robots`` is invalid.
        """
        own = {name: getattr(self, name) for name in _OF_A_ROBOT}
        if self.robots is None:
            return {"robot": RobotConfig(**own)}
        for name in _OF_A_ROBOT:
            if name not in ("controller", "controller_kwargs") and own[name]:
                raise ConflictingOptionsError([name, "robots"], f"set '{name}' in each entry of robots instead")
        if not self.robots:
            raise ParameterValueError("robots", self.robots, "a mapping with at least one robot, by name")
        shared = {"controller": self.controller, "controller_kwargs": self.controller_kwargs}
        return {name: RobotConfig.from_value(name, value, shared) for name, value in self.robots.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return the flat keywords that differ from the defaults, as JSON-serializable values.

        Raises:
            ConfigurationError: A field contains an object that is not JSON-serializable, such as a record.
        """
        return {name: _plain(name, value) for name, value in self._keywords().items()}

    def _keywords(self) -> dict[str, Any]:
        own = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "task_parameters"}
        return {name: value for name, value in own.items() if value != _DEFAULTS[name]} | dict(self.task_parameters)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, EnvConfig):
            return NotImplemented
        return bool(_lists(self._keywords()) == _lists(other._keywords()))


_DEFAULTS = {
    item.name: item.default if item.default_factory is MISSING else item.default_factory() for item in fields(EnvConfig)
}
KEYWORDS = frozenset(_DEFAULTS) - {"task_parameters"}
"""Names of the keywords that every environment accepts, regardless of its task."""


def _check(config: EnvConfig, types: Any, wanted: str, *names: str) -> None:
    for name in names:
        value = getattr(config, name)
        if not isinstance(value, types) or isinstance(value, bool):
            raise ParameterValueError(name, value, wanted)


def _plain(name: str, value: Any) -> Any:
    """Return a value converted to JSON types."""
    plain = _lists(value)
    try:
        json.dumps(plain, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ConfigurationError(
            f"the keyword '{name}' cannot be converted to JSON: {error}; use strings, numbers, lists and dictionaries."
        ) from error
    return plain


def _lists(value: Any) -> Any:
    """Return a value with tuples and arrays converted to lists, and NumPy numbers to Python numbers."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _lists(item) for key, item in value.items()}
    return [_lists(item) for item in value] if isinstance(value, list | tuple) else value
