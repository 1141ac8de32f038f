"""Making a certificate: which measurements there are, what each needs, and in what order."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

from frobs_core import plugins
from frobs_core.capabilities import CAPABILITIES, Level
from frobs_core.errors import ModelMismatchError, UnknownNameError
from frobs_devkit.parity.actions import ActionFile, check_actions, read_actions, smooth_actions
from frobs_devkit.parity.certificate import Certificate
from frobs_devkit.parity.gravity_drop import gravity_drop
from frobs_devkit.parity.kinematics import forward_kinematics
from frobs_devkit.parity.lidar import lidar
from frobs_devkit.parity.policy import EPISODES, policy
from frobs_devkit.parity.replay import replay
from frobs_devkit.parity.result import Comparison, Measurement, Status, skip
from frobs_devkit.parity.rewards import rewards
from frobs_devkit.parity.settling import settling
from frobs_devkit.parity.step_response import saturated_step_response, step_response
from frobs_devkit.parity.subject import Subject, make_subjects
from frobs_train import Run, versions

_log = logging.getLogger(__name__)
MEASUREMENTS = (
    "forward_kinematics",
    "step_response",
    "saturated_step_response",
    "gravity_drop",
    "replay",
    "settling",
    "lidar",
    "rewards",
    "policy",
)
"""Their names, in order; the last needs a run."""

_LONGEST_REPLAY = 200  # steps of the actions that are made where none are given


@dataclass(frozen=True, kw_only=True)
class Plan:
    """One measurement that is to be made.

    Attributes:
        name: Of the measurement.
        title: For people, where it cannot be made.
        measure: Makes it.
        needs: Capabilities that a simulator must not lack.
        environment: Whether it needs the whole environment.
    """

    name: str
    title: str
    measure: Callable[[Sequence[Subject]], Measurement]
    needs: tuple[str, ...] = ()
    environment: bool = False


def measure_parity(
    environment: str,
    simulators: Sequence[str],
    *,
    run: Run | None = None,
    actions: Path | None = None,
    only: Sequence[str] | None = None,
    episodes: int = EPISODES,
    keywords: Mapping[str, Any] | None = None,
    on_measurement: Callable[[str], None] = lambda _: None,
) -> Certificate:
    """Measure whether an environment means the same on several simulators.

    Args:
        environment: Gymnasium ID of ours.
        simulators: Names, the reference first; one that stands twice is compared with itself.
        run: Whose policy is evaluated, and whose keywords the environment is given; None: no policy.
        actions: Action file to replay; None: smooth actions of our own.
        only: Names of the measurements to make; None: all.
        episodes: Of the policy's evaluation, ≥ 1.
        keywords: Of the environment.
        on_measurement: Called with the title of each measurement before it is made.

    Raises:
        UnknownNameError: No such ID, simulator or measurement.
        ConfigurationError: Fewer than two simulators, an ID that is not ours, or a file or run that does not fit.
        CapabilityError: The environment cannot be made on the reference.
        CheckpointError: The run has no usable checkpoint.
    """
    given = {**(_keywords_of(run, environment) if run else {}), **(keywords or {})}
    file = read_actions(actions) if actions else None
    if run:
        run.newest_checkpoint()  # one that is damaged says so now, not after a minute
    wanted = _check_names(only, run)
    subjects = make_subjects(environment, simulators, given)
    reference = subjects[0]
    with reference.make() as env:
        controller = _controller(reference)
        if file is None:
            steps = min(reference.max_episode_steps, _LONGEST_REPLAY)
            file = ActionFile(
                id=environment.rpartition(":")[2],
                seed=0,
                actions=smooth_actions(env.action_space, steps, 0),
                controller=controller,
            )
        check_actions(file, env, environment, controller, str(actions or "the actions"))
        facts = _facts(reference, env.control_timestep, controller)
    measurements = []
    for plan in _plans(file, run, episodes):
        if plan.name not in wanted:
            continue
        on_measurement(plan.title)
        measurements.append(_make(plan, subjects))
    return Certificate(
        id=environment.rpartition(":")[2],
        reference=reference.label,
        simulators=tuple(subject.label for subject in subjects),
        facts=facts,
        measurements=tuple(measurements),
        versions=_versions(subjects),
        actions=file,
    )


def _check_names(only: Sequence[str] | None, run: Run | None) -> Sequence[str]:
    """Return the names of the measurements to make.

    Raises:
        UnknownNameError: There is no such measurement, or it needs a run.
    """
    names = [name for name in MEASUREMENTS if run is not None or name != "policy"]
    for name in only or ():
        if name not in names:
            raise UnknownNameError("measurement", name, names)
    return only or names


def _plans(file: ActionFile, run: Run | None, episodes: int) -> list[Plan]:
    plans = [
        Plan(name="forward_kinematics", title="Forward kinematics", measure=forward_kinematics),
        Plan(name="step_response", title="Step response", measure=step_response, needs=("drive",)),
        Plan(
            name="saturated_step_response",
            title="Step response, saturated",
            measure=saturated_step_response,
            needs=("drive",),
        ),
        Plan(name="gravity_drop", title="Gravity drop", measure=gravity_drop, needs=("drive",)),
        Plan(name="replay", title="Replay", measure=partial(replay, file=file), environment=True),
        Plan(name="settling", title="Contact settling", measure=settling, needs=("contacts",)),
        Plan(name="lidar", title="Lidar", measure=lidar, needs=("rays",)),
        Plan(name="rewards", title="Rewards", measure=rewards, environment=True),
    ]
    if run is not None:
        plans.append(
            Plan(name="policy", title="Policy", measure=partial(policy, run=run, episodes=episodes), environment=True)
        )
    return plans


def _make(plan: Plan, subjects: Sequence[Subject]) -> Measurement:
    """Make one measurement with the simulators that can; what the others lack is told, and so is what goes wrong."""
    reference = subjects[0]
    lacks = {subject.label: _missing(plan, subject) for subject in subjects}
    able = [subject for subject in subjects if not lacks[subject.label]]
    unable = [skip(s.label, reference.label, lacks[s.label]) for s in subjects[1:] if lacks[s.label]]
    if lacks[reference.label]:
        reason = f"{reference.label}, the reference, cannot: {lacks[reference.label]}"
        return _unmade(plan, [skip(s.label, reference.label, reason) for s in subjects[1:]])
    if len(able) < 2:
        return _unmade(plan, unable)
    try:
        found = plan.measure(able)
    except Exception as error:  # what one engine does wrong must not hide what was found about the others
        _log.debug("%s failed", plan.name, exc_info=True)
        reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
        failed = [
            Comparison(quantity="", simulator=s.label, against=reference.label, status=Status.FAILED, reason=reason)
            for s in able[1:]
        ]
        return _unmade(plan, [*failed, *unable])
    return replace(found, comparisons=(*found.comparisons, *unable))


def _missing(plan: Plan, subject: Subject) -> str:
    for capability in plan.needs:
        if subject.level(capability) == Level.UNSUPPORTED:
            return f"it does not claim '{capability}' ({CAPABILITIES[capability]})"
    return subject.lacks if plan.environment else ""


def _unmade(plan: Plan, comparisons: Sequence[Comparison]) -> Measurement:
    return Measurement(name=plan.name, title=plan.title, summary="Not measured.", comparisons=tuple(comparisons))


def _keywords_of(run: Run, environment: str) -> Mapping[str, Any]:
    theirs, ours = run.config.environment.rpartition(":")[2], environment.rpartition(":")[2]
    if theirs != ours:
        raise ModelMismatchError(
            f"the run {run.path}", "the ID", f"'{theirs}'", f"'{ours}'; use frobs parity {theirs} --run …"
        )
    return run.config.environment_kwargs


def _controller(subject: Subject) -> str:
    from frobs_core.registry import find_spec

    return str({**find_spec(subject.environment).kwargs, **subject.keywords}["controller"])


def _facts(subject: Subject, control_timestep: float, controller: str) -> dict[str, str]:
    robot = subject.placement
    return {
        "robot": f"{robot.robot.name}: {len(robot.model.joint_names)} joints, {len(robot.model.links)} links",
        "controller": controller,
        "physics_timestep": f"{subject.physics_timestep:g} s",
        "control_timestep": f"{control_timestep:g} s",
        "gravity": f"({', '.join(f'{component:g}' for component in subject.gravity)}) m/s²",
    }


def _versions(subjects: Sequence[Subject]) -> dict[str, Any]:
    """Return the versions of everything that decides over numbers, with the engines that the simulators are made of."""
    engines = {}
    for subject in subjects:
        distribution = plugins.get_report("simulator", subject.simulator).distribution
        try:
            needed = metadata.requires(distribution) or []
        except metadata.PackageNotFoundError:
            continue
        for requirement in needed:
            name = _name(requirement)
            if not name.startswith("frobs") and "extra ==" not in requirement:
                engines[name] = metadata.version(name)
    return {**versions(), "engines": engines}


def _name(requirement: str) -> str:
    """Return the distribution that a requirement names: ``"mujoco>=4.0"`` is of ``mujoco``."""
    found = re.match(r"[\w.-]+", requirement)
    return found[0] if found else ""
