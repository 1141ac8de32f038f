"""A simulator to compare, together with the environment for the comparison."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from frobs_core import plugins
from frobs_core.contracts import CommandMode, RobotHandle, Simulation, Task
from frobs_core.description import Body, Placement, Scene
from frobs_core.kernel.compose import needs_of_task
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.robot_config import find_record
from frobs_core.models import JointLimits, JointType
from frobs_core.plugins.capabilities import check_capabilities
from frobs_core.plugins.records import ControllerRecord, Level, SimulatorRecord, TaskRecord
from frobs_core.plugins.registry import find_spec
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import CapabilityError, ConfigurationError, UnknownNameError, UnsuitableRobotError
from frobs_devkit.parity.result import Comparison, judge, skip
from frobs_devkit.parity.tolerances import TOLERANCES
from frobs_devkit.simulations import simulate
from frobs_train import make_env


@dataclass(frozen=True, kw_only=True)
class Subject:
    """A simulator to compare, and the environment for the comparison.

    Attributes:
        label: Unique name of the simulator in the certificate.
        simulator: Name of the simulator.
        record: Record of the simulator.
        environment: Gymnasium ID of a FRobs environment.
        keywords: Keywords of the environment, except ``simulator``.
        placement: Placement of the environment's robot.
        gravity: Gravity of the task [m/s²].
        free_bodies: Free bodies in the task's scene that are not attached to anything, by name.
        physics_timestep: Duration of a physics step [s].
        decimation: Number of physics steps per control step.
        max_episode_steps: Maximum number of control steps in an episode.
        lacks: Why the simulator cannot run the environment, or an empty string if it can.
    """

    label: str
    simulator: str
    record: SimulatorRecord
    environment: str
    keywords: Mapping[str, Any] = field(default_factory=dict)
    placement: Placement
    gravity: tuple[float, float, float]
    free_bodies: Mapping[str, Body] = field(default_factory=dict)
    physics_timestep: float
    decimation: int
    max_episode_steps: int
    lacks: str = ""

    def level(self, capability: str) -> Level:
        """Return the level at which the simulator claims to support a capability."""
        return self.record.capabilities.get(capability, Level.UNSUPPORTED)

    @contextmanager
    def simulate(
        self,
        placement: Placement,
        bodies: Mapping[str, Body] | None = None,
        *,
        floor: bool = False,
        floor_friction: float = 1.0,
    ) -> Iterator[tuple[Simulation, RobotHandle]]:
        """Build and reset a simulation of one robot in a custom scene.

        The simulation is closed after the ``with`` block.

        Args:
            placement: Placement of the robot.
            bodies: Bodies of the scene, by name.
            floor: Whether the scene has a floor.
            floor_friction: Friction coefficient of the floor.
        """
        surroundings: dict[str, Any] = {"floor": floor, "floor_friction": floor_friction, "bodies": bodies or {}}
        scene = Scene(gravity=self.gravity, robot_pose=placement.pose, **surroundings)
        timestep = self.physics_timestep
        with simulate(self.record, placement, scene, physics_timestep=timestep, num_threads=1) as built:
            yield built

    @contextmanager
    def make(self) -> Iterator[RobotEnv]:
        """Create the environment without a time limit. The environment is closed after the ``with`` block."""
        with closing(make_env(self.environment, {**self.keywords, "simulator": self.simulator})) as env:
            assert isinstance(env.unwrapped, RobotEnv)
            yield env.unwrapped

    @property
    def joint_unit(self) -> str:
        """Unit of joint positions: ``"rad"``, ``"m"``, or ``"rad or m"`` if the robot has both types of joints."""
        slides = {joint.type is JointType.PRISMATIC for joint in self.placement.model.actuated_joints}
        return "rad or m" if len(slides) > 1 else "m" if True in slides else "rad"

    def alone(self, effort_limits: Sequence[float] | Floats | None = None) -> Placement:
        """Return the placement of a freely moving robot, with a fixed base and without self-collisions.

        Args:
            effort_limits: Effort limits, (dof,) [N·m or N]. By default, the limits in the model apply.
        """
        model = self.placement.model
        if effort_limits is not None:
            limits = dict(zip(model.joint_names, np.asarray(effort_limits, float).tolist(), strict=True))

            def limited(old: JointLimits, name: str) -> JointLimits:
                return replace(old, effort=limits[name]) if name in limits else old

            joints = tuple(replace(joint, limits=limited(joint.limits, joint.name)) for joint in model.joints)
            model = replace(model, joints=joints)
        robot = replace(self.placement.robot, base="fixed", self_collision=False)
        return replace(self.placement, robot=robot, model=model)

    def driven(self, mode: CommandMode, effort_limits: Sequence[float] | Floats | None = None) -> Placement:
        """Return :meth:`alone` for ``effort_limits`` (dof,) [N·m or N], with drives in the given command mode."""
        return replace(self.alone(effort_limits), command_mode=mode)


@dataclass(frozen=True)
class Pair:
    """A simulator, and the reference with which it is compared."""

    reference: Subject
    other: Subject

    def judge(
        self, tolerance_name: str, quantity: str, errors: Floats | float, *, exact: bool | None = None, **options: Any
    ) -> Comparison:
        """Compare the largest error with its tolerance, see :func:`~frobs_devkit.parity.result.judge`.

        By default, the exact tolerance applies if both simulators follow the drive law exactly.
        """
        exact = follows_exactly(self.reference, self.other) if exact is None else exact
        return judge(tolerance_name, quantity, self.other.label, self.reference.label, errors, exact=exact, **options)

    def skip(self, reason: str, quantity: str = "") -> Comparison:
        """Return a skipped comparison with the given reason."""
        return skip(self.other.label, self.reference.label, reason, quantity)


def pairs_of(subjects: Sequence[Subject]) -> list[Pair]:
    """Return each simulator except the first one, paired with the first one as the reference."""
    return [Pair(subjects[0], other) for other in subjects[1:]]


def make_subjects(environment: str, simulators: Sequence[str], keywords: Mapping[str, Any]) -> list[Subject]:
    """Look up the simulators to compare.

    The first simulator is the reference, which must be able to run the environment.

    Args:
        environment: Gymnasium ID of a FRobs environment.
        simulators: Names of the simulators. A simulator that is listed twice is compared with itself.
        keywords: Keywords of the environment.

    Raises:
        UnknownNameError: The ID or a simulator does not exist.
        ConfigurationError: There are fewer than two simulators, or the ID does not belong to a FRobs environment.
        CapabilityError: The reference simulator cannot run the environment.
    """
    if len(simulators) < 2:
        raise ConfigurationError(
            f"parity requires at least two simulators, got {', '.join(simulators) or 'none'}. Installed simulators: "
            f"{', '.join(plugins.records('simulator'))}; 'mujoco,mujoco' compares MuJoCo with itself."
        )
    spec = find_spec(environment)
    if spec.entry_point != f"{RobotEnv.__module__}:{RobotEnv.__name__}":
        raise ConfigurationError(
            f"'{environment}' is not a FRobs environment; only FRobs environments can run on several simulators."
        )
    records = [_simulator(name) for name in simulators]
    given = {name: value for name, value in keywords.items() if name != "simulator"}
    with closing(make_env(environment, {**given, "simulator": simulators[0]})) as env:
        inner = env.unwrapped
        assert isinstance(inner, RobotEnv)
        if not inner.robot.dof:
            raise UnsuitableRobotError(inner.robot.robot.name, "has no actuated joint, so there is nothing to compare.")
        scene = inner.task.scene()
        placement = Placement(
            robot=inner.robot.robot,
            model=inner.robot.model,
            pose=scene.robot_pose,
            command_mode=inner.controller.command_mode,
        )
        names = {**spec.kwargs, **given}
        attached = {side for each in scene.attachments.values() for side in (each.first, each.second)}
        free = {name: body for name, body in scene.bodies.items() if body.is_free and name not in attached}
        return [
            Subject(
                label=name if simulators.count(name) == 1 else f"{name} ({simulators[: i + 1].count(name)})",
                simulator=name,
                record=record,
                environment=environment,
                keywords=given,
                placement=placement,
                gravity=scene.gravity,
                free_bodies=free,
                physics_timestep=inner.simulation.physics_timestep,
                decimation=inner.decimation,
                max_episode_steps=spec.max_episode_steps or 100,
                lacks=_lacks(name, record, names, inner.task),
            )
            for i, (name, record) in enumerate(zip(simulators, records, strict=True))
        ]


def _simulator(name: str) -> SimulatorRecord:
    try:
        record = plugins.get_record("simulator", name)
    except UnknownNameError as error:
        hint = error.install_hint or f"pip install frobs-sim-{name}"
        raise UnknownNameError("simulator", name, error.available, error.failed, hint) from error
    assert isinstance(record, SimulatorRecord)
    record.load()  # reports a missing engine before the measurements start
    return record


def _lacks(name: str, record: SimulatorRecord, names: Mapping[str, Any], task: Task) -> str:
    """Return the requirements of the task and the controller that a simulator does not support, as text."""
    needs = needs_of_task(find_record(TaskRecord, names["task"]), task)
    controller = find_record(ControllerRecord, names["controller"])
    needs[f"controller '{controller.name}'"] = controller.needs
    try:
        check_capabilities(name, record.capabilities, needs)
    except CapabilityError as error:
        return "; ".join(f"{who} needs '{what}' {needed}" for who, what, needed, _ in error.missing)
    return ""


def tolerance_line(tolerance_name: str, subjects: Sequence[Subject]) -> float | None:
    """Return the tolerance to draw: the exact tolerance, if all simulators follow the drive law exactly, or None."""
    return TOLERANCES[tolerance_name].exact if follows_exactly(*subjects) else None


def follows_exactly(*subjects: Subject) -> bool:
    """Return whether free motion follows the drive law exactly on all given simulators.

    The drive law only covers the effects of drives, damping and gravity on joints. Joint friction and mimic joints are
    constraints, which each engine solves differently.
    """
    plain = all(joint.mimic is None and not joint.friction for joint in subjects[0].placement.model.joints)
    return plain and all(subject.level("drive") == Level.EXACT for subject in subjects)
