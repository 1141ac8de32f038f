"""Environment configuration, which contains all keywords that ``gym.make(id, ...)`` accepts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

import numpy as np

from frobs_core.deprecation import rename_keywords
from frobs_core.kernel.robot_config import RENAMED_KEYWORDS, RobotConfig, RobotKeywords
from frobs_core.kernel.viewers import check_render_mode
from frobs_core.plugins.records import SimulatorDefaults, SimulatorRecord, TaskRecord
from frobs_core.util.errors import ConfigurationError, ConflictingOptionsError, MissingSettingError, ParameterValueError
from frobs_core.util.validation import boolean, check_types, image_size, whole_number

MAX_THREADS = 1_024
"""Maximum number of threads or worker processes of a simulator."""

MAX_SIDE = 16_384
"""Maximum height and width of a rendered image [pixels]. A graphics card may support less."""

_ROBOT_FIELDS = [item.name for item in fields(RobotKeywords)]


@dataclass(frozen=True, kw_only=True, eq=False)
class EnvConfig(RobotKeywords):
    """Keywords of an environment, including the :class:`~frobs_core.kernel.robot_config.RobotKeywords` of its robot.

    :meth:`from_dict` and :meth:`to_dict` convert between a configuration and the flat keywords of ``gymnasium.make``,
    which include the task's parameters.

    Args:
        task: Name of the task, or a task record.
        robots: Configurations of several robots by name, instead of ``robot``. Each value is a robot's name or a
            mapping with the fields of :class:`frobs_core.kernel.robot_config.RobotConfig`, for example ``{"left":
            "irb120", "right": {"robot": "ur5", "controller": "joint_position"}}``. An entry that omits ``controller``
            or ``controller_kwargs`` uses the environment's value of that field.
        simulator: Name of the simulator, or a simulator record.
        reward_type: One of the task's reward types, or None for the first reward type.
        render_mode: ``"rgb_array"`` for images, ``"human"`` for the window of the simulator, the name of another viewer
            that a plugin provides, such as ``"browser"``, or None.
        camera: Camera that ``render`` uses, or None for the scene's first camera.
        render_size: Size of rendered images, (height, width) [pixels].
        control_timestep: Time between two actions [s]. Defaults to the controller's timestep, or to the task's timestep
            if the controller does not define a timestep.
        physics_timestep: Duration of one engine step [s], or None for the task's default.
        simulator_kwargs: Keywords of the simulator, such as the solver. ``frobs show simulator:NAME`` lists the
            keywords.
        observations: Observation terms to add to the task's terms, by name, for example ``{"joints": {"type":
            "joint_efforts"}, "wrist": {"camera": "overview", "size": [84, 84]}}``; see :mod:`frobs_core.kernel.added_terms`. A
            value of None drops the task's term with that name, and ``{"*": None}`` drops all task terms except goals.
        cameras: Cameras to add to the task's scene, by name, for example ``{"wrist": {"robot": "robot", "link":
            "tool0", "pos": [0, 0.05, 0], "target": [0, 0, 0.2], "fov_y": 60}}`` [m, deg]. A camera is fixed to a
            ``link`` of a robot (by default the first), to a ``body`` of the scene, or else in the world. Optional
            settings are ``up``, and ``intrinsics`` instead of ``fov_y``; see :class:`frobs_core.description.Camera`. If
            the scene already has a camera with this name, only the given settings change.
        num_threads: Number of engine threads, or 0 for one thread per processor.
        randomize: Domain randomization settings; see :mod:`frobs_core.sensing.randomization`.
        fit: Whether to fit the task to its robot: the place and the sizes of objects, the start posture and the arm's
            steps. By default, a task is fitted to a robot that is passed as a model file. Keywords that you set yourself
            take precedence. Tasks that do not support it ignore this keyword.
        task_parameters: Keywords of the task.

    Raises:
        ConfigurationError: A value has the wrong type.
    """

    task: str | TaskRecord
    robots: Mapping[str, Any] | None = None
    simulator: str | SimulatorRecord = "mujoco"
    reward_type: str | None = None
    render_mode: str | None = None
    camera: str | None = None
    render_size: tuple[int, int] = (480, 640)
    control_timestep: float | None = None
    physics_timestep: float | None = None
    simulator_kwargs: Mapping[str, Any] = field(default_factory=dict)
    observations: Mapping[str, Any] = field(default_factory=dict)
    cameras: Mapping[str, Any] = field(default_factory=dict)
    num_threads: int = 0
    randomize: Mapping[str, Any] | None = None
    fit: bool | None = None
    task_parameters: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_types(
            self,
            task=(str | TaskRecord, "a name or a TaskRecord"),
            simulator=(str | SimulatorRecord, "a name or a SimulatorRecord"),
        )
        if isinstance(self.simulator_kwargs, SimulatorDefaults):
            object.__setattr__(self, "simulator_kwargs", self.simulator_kwargs.of(self.simulator))
        whole_number("num_threads", self.num_threads, highest=MAX_THREADS)
        if self.fit is not None:
            boolean("fit", self.fit)
        if self.render_mode is not None:
            check_render_mode(self.render_mode)
        object.__setattr__(self, "render_size", image_size("render_size", self.render_size, MAX_SIDE))

    @classmethod
    def from_dict(cls, keywords: Mapping[str, Any]) -> EnvConfig:
        """Create a configuration from flat keywords. Keywords that are not fields become task parameters.

        Raises:
            ConfigurationError: A value has the wrong type, or ``task`` is missing.
        """
        keywords = rename_keywords(keywords, RENAMED_KEYWORDS)
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
        own = {name: getattr(self, name) for name in _ROBOT_FIELDS}
        if self.robots is None:
            return {"robot": RobotConfig(**own)}
        for name in _ROBOT_FIELDS:
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
        keywords = self._keywords()
        for name, value in keywords.items():
            try:
                json.dumps(value, allow_nan=False)
            except (TypeError, ValueError) as error:
                raise ConfigurationError(
                    f"the keyword '{name}' cannot be converted to JSON: {error}; use strings, numbers, lists and "
                    "dictionaries."
                ) from error
        return keywords

    def _keywords(self) -> dict[str, Any]:
        own = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "task_parameters"}
        changed = {name: value for name, value in own.items() if value != _DEFAULTS[name]}
        keywords: dict[str, Any] = _lists({**changed, **self.task_parameters})
        return keywords

    def __eq__(self, other: object) -> bool:
        return self._keywords() == other._keywords() if isinstance(other, EnvConfig) else NotImplemented


_DEFAULTS = {
    item.name: item.default if item.default_factory is MISSING else item.default_factory() for item in fields(EnvConfig)
}
KEYWORDS = frozenset(_DEFAULTS) - {"task_parameters"}
"""Names of the keywords that every environment accepts, regardless of its task."""


def _lists(value: Any) -> Any:
    """Return a value with tuples and arrays converted to lists, and NumPy numbers to Python numbers."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _lists(item) for key, item in value.items()}
    return [_lists(item) for item in value] if isinstance(value, list | tuple) else value
