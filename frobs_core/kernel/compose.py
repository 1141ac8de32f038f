"""Construction of environments from names. This is the only module that connects the registry to the environments."""

from __future__ import annotations

import inspect
import logging
import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from frobs_core.contracts import Controller, RobotHandle, Simulation, StepContext, Task
from frobs_core.contracts.control import Control, RobotControl, check_robot, joint_groups
from frobs_core.description import Placement, Robot, Scene
from frobs_core.kernel.added_terms import AddedTerms, needed_capabilities, without_dropped
from frobs_core.kernel.added_terms import read_settings as read_observations
from frobs_core.kernel.config import KEYWORDS, EnvConfig
from frobs_core.kernel.fitting import check_replaced, fit_robots
from frobs_core.kernel.robot_config import RobotConfig, find_record
from frobs_core.models import RobotModel
from frobs_core.plugins.capabilities import check_capabilities
from frobs_core.plugins.records import Level, SimulatorRecord, TaskRecord
from frobs_core.sensing.observation import Observations
from frobs_core.sensing.randomization import Randomization, Settings, physical_parameters, read_settings
from frobs_core.sensing.sensors import with_contacts
from frobs_core.util.errors import (
    ConfigurationError,
    ConflictingOptionsError,
    InvalidTimestepError,
    ParameterValueError,
    PluginError,
    check_keys,
)
from frobs_core.util.keywords import constructor_parameters
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import choice, whole_number

_log = logging.getLogger("frobs")

MAX_NUM_ENVS = 100_000
"""Maximum number of environments per simulation. Each environment uses at least 10 kB of memory, so the maximum number
of environments uses at least 1 GB.
"""

MAX_DECIMATION = 10_000
"""Maximum number of physics steps per control step."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Everything about an environment that is known before its simulator is imported.

    Attributes:
        simulator: Record of the simulator.
        task_record: Record of the task.
        task: The task, not yet bound.
        controllers: The controllers by robot and joint group, not yet bound.
        everything: All robots of the scene, with their models.
        settings: Settings of the randomization, or None.
        observed: Settings of the added observation terms.
        control_timestep: [s]
        physics_timestep: [s]
        decimation: Number of physics steps per control step.
    """

    simulator: SimulatorRecord
    task_record: TaskRecord
    task: Task
    scene: Scene
    controllers: Mapping[str, Mapping[str, Controller]]
    everything: Mapping[str, Placement]
    settings: Settings | None
    observed: dict[str, dict[str, Any]]
    control_timestep: float
    physics_timestep: float
    decimation: int


@dataclass(frozen=True, kw_only=True)
class Parts(Plan):
    """Connected parts of an environment, such as the simulation and the controllers, and their plan.

    Attributes:
        robot: Handle of the first controlled robot.
        controller: Controller of the first controlled robot's first joint group.
        check_reset: Function that raises CapabilityError if the simulator does not support a reset with the given
            option names.
        bind_terms: Function that binds observation terms outside the observation, given their settings.
    """

    simulation: Simulation
    control: Control
    observations: Observations
    added_terms: AddedTerms
    context: StepContext
    robot: RobotHandle
    controller: Controller
    check_reset: Callable[[Collection[str]], None]
    bind_terms: Callable[[Mapping[str, Any]], AddedTerms]
    randomization: Randomization | None


def plan(config: EnvConfig, num_envs: int) -> Plan:
    """Check the keywords of an environment without importing an engine, and build its task and its controllers.

    The arguments and the errors are those of :func:`compose`.
    """
    check_num_envs(num_envs)
    simulator = find_record(SimulatorRecord, config.simulator)
    task = find_record(TaskRecord, config.task)
    settings = read_settings(config.randomize)
    observed = read_observations(config.observations)
    robots = config.robot_configs()
    task_class: Any = task.load()
    fitted = fit_robots(task_class, robots, config.fit)
    robots, descriptions = fitted.configs, fitted.robots
    chosen = {name: robot.controllers(descriptions[name]) for name, robot in robots.items()}
    records = [record for of_robot in chosen.values() for record, _ in of_robot.values()]

    _check_pace(simulator, num_envs)
    check_replaced(task_class, config)
    the_task: Task = build(f"task '{task.name}'", task_class, {**fitted.task, **config.task_parameters}, KEYWORDS)
    for name in the_task.robots:
        check_robot(f"task '{task.name}'", name, robots)
    needs = needs_of_task(task, the_task)
    needs |= {f"controller '{record.name}'": record.needs for record in records}
    needed = physical_parameters() if settings is not None else {}
    for name in () if settings is None else dict.fromkeys(item.parameter for item in settings.items):
        if name in needed:
            needs[f"randomize.{name}"] = {needed[name]: Level.APPROXIMATE}
    needs |= needed_capabilities(observed)
    check_capabilities(simulator.name, simulator.capabilities, needs)
    controllers: dict[str, dict[str, Controller]] = {
        name: {
            group: build(f"controller '{record.name}'", record.load(), keywords)
            for group, (record, keywords) in of_robot.items()
        }
        for name, of_robot in chosen.items()
    }
    the_task.reward_type = (
        the_task.reward_types[0]
        if config.reward_type is None
        else choice(f"task '{task.name}': reward_type", config.reward_type, the_task.reward_types)
    )
    if type(the_task).reward is Task.reward and the_task.reward_type not in the_task.rewards:
        raise PluginError(
            f"task '{task.name}': {task_class.__name__} defines no reward of type '{the_task.reward_type}'; add its terms "
            "to 'rewards', or define reward()."
        )

    control, physics = config.control_timestep, config.physics_timestep
    if control is None:
        control = next((record.control_timestep for record in records if record.control_timestep is not None), None)
    control = the_task.control_timestep if control is None else control
    physics = the_task.physics_timestep if physics is None else physics
    decimation = count_physics_steps(control, physics)

    of_task = the_task.scene()
    scene = of_task.with_cameras_of(descriptions)
    placements = {}
    for name, description in descriptions.items():
        model = fitted.models.get(name) or description.read_model()
        placements[name] = _place(robots[name], description, model, controllers[name], scene, name)
    _check_apart(placements)
    everything = scene.all_robots(placements)
    if config.cameras:
        from frobs_core.kernel.cameras import with_cameras  # imports pydantic

        scene = with_cameras(scene, config.cameras, everything, scene.cameras.keys() - of_task.cameras.keys())
    check_capabilities(simulator.name, simulator.capabilities, _needs_of_cameras(scene, config.cameras))
    if simulator.capabilities.get("contacts", Level.UNSUPPORTED) != Level.UNSUPPORTED:
        scene = with_contacts(scene, everything)
    return Plan(
        simulator=simulator,
        task_record=task,
        task=the_task,
        scene=scene,
        controllers=controllers,
        everything=everything,
        settings=settings,
        observed=observed,
        control_timestep=control,
        physics_timestep=physics,
        decimation=decimation,
    )


def compose(config: EnvConfig, num_envs: int) -> Parts:
    """Build and bind the parts of an environment.

    Args:
        config: The environment's keywords.
        num_envs: ≥ 1.

    Raises:
        FrobsError: See :class:`~frobs_core.kernel.env.RobotEnv`.
    """
    planned = plan(config, num_envs)
    simulator, task, controllers = planned.simulator, planned.task, planned.controllers
    scene, everything, settings, control = planned.scene, planned.everything, planned.settings, planned.control_timestep
    engine = simulator.load()
    check_keys(f"simulator '{simulator.name}'", config.simulator_kwargs, simulator_defaults(engine))
    simulation: Simulation = engine(
        everything,
        scene,
        num_envs=num_envs,
        physics_timestep=planned.physics_timestep,
        num_threads=config.num_threads,
        **config.simulator_kwargs,
    )
    for placement in everything.values():
        _log_losses(engine, placement)
    try:
        for of_robot in controllers.values():
            for controller in of_robot.values():
                controller.bind_scene(scene, simulation)
        joined = Control(
            {
                name: RobotControl(simulation.robots[name], of_robot, control, planned.decimation)
                for name, of_robot in controllers.items()
            }
        )
        first = next(iter(joined.robots.values()))
        controller = next(iter(first.controllers.values()))
        task.bind(simulation=simulation, control=joined, control_timestep=control)
        commands = {name: robot.robot.home for name, robot in joined.robots.items()}
        context = StepContext(RandomSource(num_envs), joined.action_space, commands)
        added = AddedTerms(planned.observed, simulation, scene, joined, context, task.markers, control)
        terms = without_dropped(task.observation_terms(), config.observations)
        for name in added.terms:
            if name in terms:
                raise ConfigurationError(
                    f"the observation term '{name}' is already a term of the task; choose another name."
                )
        observations = Observations(num_envs, {**terms, **added.terms})
        randomization = None if settings is None else Randomization(settings, simulation, joined, observations, control)
    except BaseException:
        simulation.close()
        raise

    def bind_terms(given: Mapping[str, Any]) -> AddedTerms:
        settings = read_observations(given)
        for name in given.keys() - settings.keys():
            raise ConfigurationError(
                f"the observation term '{name}' is None, but only a term of the observation can be dropped."
            )
        check_capabilities(simulator.name, simulator.capabilities, needed_capabilities(settings))
        return AddedTerms(settings, simulation, scene, joined, context, task.markers, control)

    return Parts(
        **vars(planned),
        simulation=simulation,
        control=joined,
        observations=observations,
        added_terms=added,
        context=context,
        robot=first.robot,
        controller=controller,
        check_reset=lambda options: check_capabilities(
            simulator.name, simulator.capabilities, needs_of_task(planned.task_record, task, options)
        ),
        bind_terms=bind_terms,
        randomization=randomization,
    )


def needs_of_task(record: TaskRecord, task: Task, options: Collection[str] = ()) -> dict[str, Mapping[str, Level]]:
    """Return the capabilities that a task and the given reset options require, by their name in error messages."""
    who = f"task '{record.name}'" + (f", reset with {' and '.join(options)}" if options else "")
    return {who: {**record.needs, **task.reset_needs(options)}}


def _needs_of_cameras(scene: Scene, added: Collection[str]) -> dict[str, dict[str, Level]]:
    """Return the capabilities that added cameras and cameras with intrinsics require."""
    needs = {f"cameras.{name}": {"cameras": Level.APPROXIMATE} for name in added}
    for name, camera in scene.cameras.items():
        if camera.intrinsics is not None:
            needs.setdefault(f"cameras.{name}", {})["camera_intrinsics"] = Level.APPROXIMATE
    return needs


def _check_pace(simulator: SimulatorRecord, num_envs: int) -> None:
    """Check that a paced simulator has a single environment."""
    if simulator.is_paced and num_envs > 1:
        rule = f"1, because simulator '{simulator.name}' is paced and supports only one environment"
        raise ParameterValueError("num_envs", num_envs, rule)


def _place(
    config: RobotConfig,
    robot: Robot,
    model: RobotModel,
    controllers: Mapping[str, Controller],
    scene: Scene,
    name: str,
) -> Placement:
    """Return a robot's placement, including the command modes of its joints."""
    groups = joint_groups(robot, model)
    modes = {joint: controllers[group].command_mode for group in controllers for joint in groups[group]}
    pose = scene.robot_poses.get(name, scene.robot_pose)
    robot, pose = config.place(robot, model, pose, on_floor=scene.floor)
    return Placement(robot=robot, model=model, pose=pose, command_mode=modes)


def _log_losses(engine: type[Simulation], placement: Placement) -> None:
    """Log the parts of an MJCF file that affect the robot's motion but are not simulated."""
    model = placement.model
    if model.format != "mjcf":
        return
    lost = [f"{row.element.replace('_', ' ')} ({row.how})" for row in engine.translation(model) if row.changes_motion]
    lost += [note.text for note in model.notes if note.rule == "physics-settings"]
    if lost:
        text = (
            "robot '%s' does not move exactly as its model file specifies: %s. Run 'frobs doctor robot %s' for details."
        )
        _log.warning(text, placement.robot.name, "; ".join(lost), model.path)


def _check_apart(placements: Mapping[str, Placement]) -> None:
    names: dict[tuple[float, ...], str] = {}
    for name, placement in placements.items():
        other = names.setdefault(placement.pose.pos, name)
        if other != name:
            raise ConflictingOptionsError(
                [f"robots.{other}", f"robots.{name}"],
                f"both robots have the position {placement.pose.pos} m; set a different pose for one of them",
            )


def build(owner: str, cls: type[Any], parameters: Mapping[str, Any], others: Iterable[str] = ()) -> Any:
    """Create an instance of a class from the user's keywords.

    Args:
        owner: Description of the object for error messages, such as ``"task 'reach'"``.
        cls: Class whose keyword-only constructor arguments are the accepted keywords.
        parameters: The keywords.
        others: Additional names that an error message may suggest.

    Raises:
        UnknownParameterError: The constructor does not accept one of the keywords.
    """
    check_keys(owner, parameters, parameter_defaults(cls), others)
    return cls(**parameters)


def parameter_defaults(cls: type[Any]) -> dict[str, Any]:
    """Return the keywords that a constructor accepts, with their defaults."""
    found = constructor_parameters(cls).values()
    return {p.name: p.default for p in found if p.kind is inspect.Parameter.KEYWORD_ONLY}


def simulator_defaults(cls: type[Simulation]) -> dict[str, Any]:
    """Return the keywords that ``simulator_kwargs`` may contain, with their defaults."""
    given_by_environment = parameter_defaults(Simulation)
    return {name: default for name, default in parameter_defaults(cls).items() if name not in given_by_environment}


def check_num_envs(num_envs: int) -> None:
    """Validate the number of environments before the simulation is built.

    Raises:
        ParameterValueError: ``num_envs`` is not a whole number from 1 to :data:`MAX_NUM_ENVS`.
    """
    whole_number("num_envs", num_envs, 1, MAX_NUM_ENVS)


def count_physics_steps(control_timestep: float, physics_timestep: float) -> int:
    """Return the decimation, which is the number of physics steps per control step.

    Args:
        control_timestep: [s]
        physics_timestep: [s]

    Raises:
        InvalidTimestepError: ``control_timestep`` is not a whole multiple of ``physics_timestep``.
        ParameterValueError: A timestep is infinite, or ``control_timestep`` exceeds ``physics_timestep`` by more than a
            factor of :data:`MAX_DECIMATION`.
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
        rule = f"at most {MAX_DECIMATION:,} times the physics_timestep of {physics_timestep} s"
        raise ParameterValueError("control_timestep", control_timestep, rule)
    return steps
