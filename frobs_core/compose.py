"""Putting an environment together from names: the only place where the registry and an environment meet."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from frobs_core import plugins
from frobs_core.capabilities import Level, check_capabilities
from frobs_core.config import KEYWORDS, EnvConfig
from frobs_core.errors import (
    ConfigurationError,
    InvalidTimestepError,
    MissingSettingError,
    ParameterValueError,
    UnknownParameterError,
)
from frobs_core.interfaces import Controller, Placement, Robot, RobotHandle, Simulation, Task
from frobs_core.models import load_model
from frobs_core.randomization import CAPABILITY, Randomization, read_settings
from frobs_core.sensors.contacts import with_contacts
from frobs_core.sensors.settings import apply_settings
from frobs_core.specs import ControllerRecord, Record, SimulatorRecord, TaskRecord
from frobs_core.validation import whole_number

_Record = TypeVar("_Record", bound=Record)

MAX_NUM_ENVS = 100_000
"""Most environments that are stepped together: each takes 10 kB or more, so that these take a gigabyte."""

MAX_THREADS = 1_024
"""Most threads, or worker processes, of a simulator."""

MAX_DECIMATION = 10_000
"""Most physics steps in a control step."""

_MODEL_ENDINGS = (".urdf", ".xacro", ".xml", ".mjcf")


@dataclass(frozen=True)
class Parts:
    """What an environment consists of, bound to each other."""

    simulation: Simulation
    robot: RobotHandle
    controller: Controller
    task: Task
    control_timestep: float
    decimation: int
    randomization: Randomization | None = None


def compose(config: EnvConfig, num_envs: int) -> Parts:
    """Build and bind the parts of an environment.

    Args:
        config: The environment's keywords.
        num_envs: ≥ 1.

    Raises:
        UnknownNameError: No plugin offers one of the names.
        UnknownParameterError: The task, the controller or the simulator does not accept a keyword.
        CapabilityError: The simulator does not support what the task, the controller or the randomization needs.
        ConfigurationError: A value cannot be used.
    """
    check_num_envs(num_envs)
    if config.num_threads > MAX_THREADS:
        raise ParameterValueError("num_threads", config.num_threads, f"small enough: the limit is {MAX_THREADS:,}")
    simulator = _record(SimulatorRecord, "simulator", config.simulator)
    task = _record(TaskRecord, "task", config.task)
    controller = _record(ControllerRecord, "controller", config.controller)
    settings = read_settings(config.randomize)
    needs: dict[str, Mapping[str, Level]] = {
        f"task '{task.name}'": task.needs,
        f"controller '{controller.name}'": controller.needs,
    }
    for name in () if settings is None else dict.fromkeys(item.parameter for item in settings.items):
        if name in CAPABILITY:
            needs[f"randomize.{name}"] = {CAPABILITY[name]: Level.APPROXIMATE}
    check_capabilities(simulator.name, simulator.capabilities, needs)
    the_task: Task = build(f"task '{task.name}'", task.load(), config.task_parameters, KEYWORDS)
    the_controller: Controller = build(f"controller '{controller.name}'", controller.load(), config.controller_kwargs)
    the_task.reward_type = _reward_type(task.name, the_task, config.reward_type)

    control, physics = config.control_timestep, config.physics_timestep
    if control is None:
        control = controller.control_timestep
    control = the_task.control_timestep if control is None else control
    physics = the_task.physics_timestep if physics is None else physics
    decimation = count_physics_steps(control, physics)

    scene = the_task.scene()
    description = describe(
        config.robot,
        tcp=config.tcp,
        robot_args=config.robot_args,
        package_paths=config.package_paths,
        home=config.home,
        sensors=config.sensors,
    )
    model = load_model(description.model, xacro_args=description.xacro_args, package_paths=description.package_paths)
    placement = Placement(
        robot=description, model=model, pose=scene.robot_pose, command_mode=the_controller.command_mode
    )
    robots = {"robot": placement, **scene.robots}
    if simulator.capabilities.get("contacts", Level.UNSUPPORTED) != Level.UNSUPPORTED:
        scene = with_contacts(scene, robots)
    engine = simulator.load()
    check_parameters(f"simulator '{simulator.name}'", config.simulator_kwargs, simulator_defaults(engine))
    simulation: Simulation = engine(
        robots,
        scene,
        num_envs=num_envs,
        physics_timestep=physics,
        num_threads=config.num_threads,
        **config.simulator_kwargs,
    )
    try:
        handle = simulation.robots["robot"]
        the_controller.bind_scene(scene, simulation)
        the_controller.bind(handle, control, decimation)
        the_task.bind(simulation, the_controller, control)
        randomization = None if settings is None else Randomization(settings, simulation, the_task, control)
    except BaseException:
        simulation.close()
        raise
    return Parts(simulation, handle, the_controller, the_task, control, decimation, randomization)


def _record(cls: type[_Record], kind: str, part: str | _Record) -> _Record:
    """Return a part's record by its name, or as it was given."""
    record = plugins.get_record(kind, part) if isinstance(part, str) else part
    assert isinstance(record, cls)
    return record


def build(owner: str, cls: type[Any], parameters: Mapping[str, Any], others: Iterable[str] = ()) -> Any:
    """Construct an implementation from the keywords that users gave.

    Args:
        owner: Name for error messages: ``"task 'reach'"``.
        cls: Class whose keyword-only constructor arguments are the accepted keywords.
        parameters: The keywords.
        others: Further names that an error may suggest.

    Raises:
        UnknownParameterError: The constructor does not accept a keyword.
    """
    check_parameters(owner, parameters, parameter_defaults(cls), others)
    return cls(**parameters)


def check_parameters(owner: str, given: Iterable[str], known: Iterable[str], others: Iterable[str] = ()) -> None:
    """Check the names of keywords; the arguments are those of :func:`build`.

    Raises:
        UnknownParameterError: A given name is not known.
    """
    for name in given:
        if name not in known:
            raise UnknownParameterError(owner, name, {*known, *others})


def parameter_defaults(cls: type[Any]) -> dict[str, Any]:
    """Return the keywords that a constructor takes, with their defaults."""
    found = inspect.signature(cls).parameters.values()
    return {p.name: p.default for p in found if p.kind is inspect.Parameter.KEYWORD_ONLY}


def simulator_defaults(cls: type[Simulation]) -> dict[str, Any]:
    """Return the keywords of a simulator that ``simulator_kwargs`` may hold, with their defaults."""
    given_by_environment = parameter_defaults(Simulation)
    return {name: default for name, default in parameter_defaults(cls).items() if name not in given_by_environment}


def check_num_envs(num_envs: int) -> None:
    """Check the number of environments before anything is built.

    Raises:
        ConfigurationError: It is not a whole number, below 1 or above :data:`MAX_NUM_ENVS`.
    """
    if whole_number("num_envs", num_envs, 1) > MAX_NUM_ENVS:
        raise ConfigurationError(
            f"num_envs is {num_envs:,}; the limit is {MAX_NUM_ENVS:,}. Each environment takes about 10 kB or more."
        )


def count_physics_steps(control_timestep: float, physics_timestep: float) -> int:
    """Return the decimation: physics steps per control step.

    Args:
        control_timestep: [s]
        physics_timestep: [s]

    Raises:
        InvalidTimestepError: The first is not a whole multiple of the second.
        ConfigurationError: It is more than :data:`MAX_DECIMATION` times the second.
    """
    for name, value in (("control_timestep", control_timestep), ("physics_timestep", physics_timestep)):
        if math.isinf(value):
            raise ParameterValueError(name, value, "a finite number of seconds")
    if not (physics_timestep > 0 and control_timestep > 0):
        raise InvalidTimestepError(control_timestep, physics_timestep)
    steps = round(control_timestep / physics_timestep)
    if steps < 1 or abs(steps * physics_timestep - control_timestep) > 1e-9 * control_timestep:
        raise InvalidTimestepError(control_timestep, physics_timestep)
    if steps > MAX_DECIMATION:
        raise ConfigurationError(
            f"control_timestep {control_timestep} s takes {steps:,} physics steps of {physics_timestep} s; the limit is "
            f"{MAX_DECIMATION:,}."
        )
    return steps


def describe(
    robot: str | Robot,
    *,
    tcp: str | None = None,
    robot_args: Mapping[str, str] | None = None,
    package_paths: Mapping[str, str] | None = None,
    home: Mapping[str, float] | None = None,
    sensors: Mapping[str, Any] | None = None,
) -> Robot:
    """Return a robot's description from its name, the path of its model file, or itself.

    Args:
        robot: Name, path of a URDF, xacro or MJCF file, or a description.
        tcp: Takes the place of its tool centre point.
        robot_args: Go before the arguments of its xacro file.
        package_paths: Go before its folders of ROS packages.
        home: Go before its joint positions at home [rad or m].
        sensors: What is other about its sensors; see :mod:`frobs_core.sensors`.

    Raises:
        UnknownNameError: No plugin offers the name, or the robot has no such sensor.
        ConfigurationError: No robot is given, or a sensor cannot be so.
    """
    if isinstance(robot, Robot):
        description = robot
    elif not robot:
        known = ", ".join(f"'{name}'" for name in plugins.records("robot")) or "none"
        raise MissingSettingError(
            "this environment",
            "a robot",
            "pass robot='path/to/arm.urdf' (or .urdf.xacro, or MJCF as .xml) and tcp='LINK', "
            f"or the name of an installed robot: {known}",
        )
    elif robot.lower().endswith(_MODEL_ENDINGS):
        description = Robot(model=robot, name=Path(robot).name.partition(".")[0])
    else:
        description = plugins.get_record("robot", robot).load()
    changes: dict[str, Any] = {} if tcp is None else {"tcp": tcp}
    for field, given in (("xacro_args", robot_args), ("package_paths", package_paths), ("home", home)):
        if given:
            changes[field] = {**getattr(description, field), **given}
    if sensors:
        changes["sensors"] = apply_settings(description.sensors, sensors)
    return replace(description, **changes)


def _reward_type(name: str, task: Task, reward_type: str | None) -> str:
    if reward_type is None:
        return task.reward_types[0]
    if reward_type not in task.reward_types:
        offered = ", ".join(f"'{known}'" for known in task.reward_types)
        raise ParameterValueError("reward_type", reward_type, f"one of {offered}", f"task '{name}'")
    return reward_type
