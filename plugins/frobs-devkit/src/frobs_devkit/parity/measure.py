"""Creates a certificate, and defines the measurements, their requirements and their order."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

from frobs_core import plugins
from frobs_core.plugins.capabilities import known_capabilities
from frobs_core.plugins.records import Level
from frobs_core.plugins.registry import find_spec
from frobs_core.util.errors import ModelMismatchError, check_name
from frobs_devkit.doctor.requirements import required_versions
from frobs_devkit.parity.actions import ActionFile, check_actions, read_actions, smooth_actions
from frobs_devkit.parity.body_experiments import fall, friction, settling, sliding
from frobs_devkit.parity.certificate import Certificate
from frobs_devkit.parity.gravity_drop import gravity_drop
from frobs_devkit.parity.kinematics import forward_kinematics
from frobs_devkit.parity.lidar import lidar
from frobs_devkit.parity.policy import EPISODES, policy
from frobs_devkit.parity.replay import replay
from frobs_devkit.parity.result import Measurement, Status
from frobs_devkit.parity.rewards import rewards
from frobs_devkit.parity.slip import slip
from frobs_devkit.parity.step_response import saturated_step_response, step_response
from frobs_devkit.parity.under_test import Subject, make_subjects, pairs_of
from frobs_train import Run, versions

_log = logging.getLogger(__name__)
_LONGEST_REPLAY = 200  # maximum number of generated actions if no action file is given


@dataclass(frozen=True)
class Plan:
    """Description of a measurement."""

    title: str  # human-readable
    measure: Callable[[Sequence[Subject]], Measurement]  # performs the measurement
    needs: tuple[str, ...] = ()  # capabilities that a simulator must support
    environment: bool = False  # whether a simulator must run the complete environment


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
    """Measure how closely several simulators agree on an environment.

    Args:
        environment: Gymnasium ID of a FRobs environment.
        simulators: Names of the simulators, the reference first. One that is listed twice is compared with itself.
        run: Run whose policy is evaluated and whose environment keywords are used, or None for no policy.
        actions: Action file to replay. Defaults to generated smooth actions.
        only: Names of the measurements to perform. Defaults to all measurements.
        episodes: Number of episodes for evaluating the policy, at least 1.
        keywords: Keywords of the environment.
        on_measurement: Function that is called with the title of each measurement before the measurement starts.

    Raises:
        UnknownNameError: The ID, a simulator or a measurement does not exist.
        ConfigurationError: There are fewer than two simulators, the ID does not belong to a FRobs environment, or a
            file or run does not match the environment.
        CapabilityError: The reference simulator cannot run the environment.
        CheckpointError: The run has no usable checkpoint.
    """
    given = dict(keywords or {})
    if run is not None:
        theirs, ours = run.config.environment.rpartition(":")[2], environment.rpartition(":")[2]
        if theirs != ours:
            hint = f"'{ours}'; use frobs parity {theirs} --run …"
            raise ModelMismatchError(f"the run {run.path}", "the ID", f"'{theirs}'", hint)
        given = {**run.config.environment_kwargs, **given}
    file = read_actions(actions) if actions else None
    if run and run.path.is_dir():
        run.newest_checkpoint()  # reports a damaged checkpoint before the measurements start
    subjects = make_subjects(environment, simulators, given)
    reference = subjects[0]
    with reference.make() as env:
        controller = str({**find_spec(environment).kwargs, **reference.keywords}["controller"])
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
    plans = _plans(file, run, episodes)
    for name in only or ():
        check_name("measurement", name, plans)
    measurements = []
    for name, plan in plans.items():
        if not only or name in only:
            on_measurement(plan.title)
            measurements.append(_make(name, plan, subjects))
    return Certificate(
        id=environment.rpartition(":")[2],
        reference=reference.label,
        simulators=tuple(subject.label for subject in subjects),
        facts=facts,
        measurements=tuple(measurements),
        versions=_versions(subjects),
        actions=file,
    )


def _plans(file: ActionFile, run: Run | None, episodes: int) -> dict[str, Plan]:
    """Return the measurements by name, in execution order. The policy is only measured if a run is given."""
    plans = {
        "forward_kinematics": Plan("Forward kinematics", forward_kinematics),
        "step_response": Plan("Step response", step_response, needs=("drive",)),
        "saturated_step_response": Plan("Step response, saturated", saturated_step_response, needs=("drive",)),
        "gravity_drop": Plan("Gravity drop", gravity_drop, needs=("drive",)),
        "replay": Plan("Replay", partial(replay, file=file), environment=True),
        "settling": Plan("Contact settling", settling, needs=("contacts",)),
        "friction": Plan("Friction", friction, needs=("contacts",)),
        "sliding": Plan("Sliding distance", sliding, needs=("contacts", "teleport"), environment=True),
        "fall": Plan("Fall and rest", fall, needs=("contacts", "teleport"), environment=True),
        "slip": Plan("Slip force", slip, needs=("contacts", "teleport", "wrench"), environment=True),
        "lidar": Plan("Lidar", lidar, needs=("rays",)),
        "rewards": Plan("Rewards", rewards, environment=True),
    }
    if run is not None:
        plans["policy"] = Plan("Policy", partial(policy, run=run, episodes=episodes), environment=True)
    return plans


def _make(name: str, plan: Plan, subjects: Sequence[Subject]) -> Measurement:
    """Run one measurement on all simulators that support it, and report unsupported simulators and failures."""
    reference = subjects[0].label
    lacks = {subject.label: _missing(plan, subject) for subject in subjects}
    able = [subject for subject in subjects if not lacks[subject.label]]
    unable = [pair.skip(lacks[pair.other.label]) for pair in pairs_of(subjects) if lacks[pair.other.label]]
    measured = Measurement(summary="Not measured.", comparisons=())
    if lacks[reference]:
        reason = f"the reference {reference} cannot be measured: {lacks[reference]}"
        unable = [pair.skip(reason) for pair in pairs_of(subjects)]
    elif len(able) > 1:
        try:
            measured = plan.measure(able)
        except Exception as error:  # a failure of one measurement must not hide the results of the others
            _log.debug("%s failed", name, exc_info=True)
            reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
            failed = [replace(pair.skip(reason), status=Status.FAILED) for pair in pairs_of(able)]
            measured = replace(measured, comparisons=tuple(failed))
    return replace(measured, name=name, title=plan.title, comparisons=(*measured.comparisons, *unable))


def _missing(plan: Plan, subject: Subject) -> str:
    for need in plan.needs:
        if subject.level(need) == Level.UNSUPPORTED:
            return f"the simulator does not support '{need}' ({known_capabilities()[need].summary})"
    return subject.lacks if plan.environment else ""


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
    """Return the versions of all software that affects the results, including the simulators' engines."""
    engines: dict[str, str] = {}
    for subject in subjects:
        distribution = plugins.get_report("simulator", subject.simulator).distribution
        with contextlib.suppress(metadata.PackageNotFoundError):
            required = required_versions(distribution)
            engines |= {name: version for name, version in required.items() if not name.startswith("frobs")}
    return {**versions(), "engines": engines}
