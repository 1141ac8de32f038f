"""Checks of a controller's timing: physics-rate updates, integrals over time, and the start of an episode."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.contracts import Controller
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, FrobsError, UnknownNameError
from frobs_core.util.keywords import constructor_parameters
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, after, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.controller.under_test import EARTH, NUM_ENVS, Bound, ControllerUnderTest

_APART = 0.05  # [rad or m] distance of the joints from where a controller expects them
_SHARE = 0.3  # tolerated difference between two divisions of the same time into steps


@after("actions_matter")
def updates_read_the_state(subject: ControllerUnderTest) -> None:
    """If the command of ``apply`` depends on the joint state, the commands of ``update`` depend on the current one."""
    with subject.bind() as bound:
        if bound.controller.rate != "physics":
            raise NotApplicable("the controller has the rate 'control', so it has no updates")
        action = bound.middle()
        for what, position, velocity in (("positions", _APART, 0.0), ("velocities", 0.0, 2.0 * _APART)):
            applied, updated = [], []
            for offset in (0.0, 1.0):
                bound.begin()
                bound.displace(offset * position, offset * velocity)
                applied.append(np.array(bound.controller.apply(action)))
                bound.begin()
                bound.controller.apply(action)
                bound.displace(offset * position, offset * velocity)
                updated.append(np.array(bound.controller.update()))
            expect(
                np.array_equal(applied[0], applied[1]) or not np.array_equal(updated[0], updated[1]),
                f"update() returns the same command whether the joint {what} have changed since apply() or not; "
                "compute each command from the state after the latest physics step.",
            )
        pairs = zip(*_commands(subject, bound), strict=True)
        expect(
            not all(np.array_equal(command, update) for command, update in pairs),
            "every update() returns the last command of apply(); use the rate 'control' instead.",
        )


def _commands(subject: ControllerUnderTest, bound: Bound) -> tuple[list[Floats], list[Floats]]:
    """Return the commands of ``apply`` and of the last ``update`` in the same control step."""
    applied, updated = [], []
    bound.begin()
    for action in bound.actions(subject.count(6), seed=3):
        applied.append(np.array(bound.controller.apply(action)))
        bound.robot.command(applied[-1])
        bound.advance()
        updated.append(np.array(bound.controller.update()))
    return applied, updated


@after("zero_action_rests", "zero_action_does_not_drift")
def commands_depend_on_time(subject: ControllerUnderTest) -> None:
    """How a command changes over time depends on the time that has passed, not on the number of steps.

    The joints are held apart from their targets, so that an integral changes the commands.
    """
    time, physics = subject.control_timestep, subject.physics_timestep
    changes, least = _changes(subject, {}), 0.1 * _APART
    halved: dict[str, dict[str, float]] = {"physics timestep": {"physics_timestep": 0.5 * physics}}
    if subject.decimation % 2 == 0:
        halved["control timestep"] = {"timestep": 0.5 * time}
    for what, steps in halved.items():
        half_step_changes = _changes(subject, steps)
        largest = float(max(np.abs(changes).max(), np.abs(half_step_changes).max()))
        if largest < least:
            continue  # corrections in each step, not an integral over time
        problem = (
            f"change of a command during {len(changes)} control steps, compared with the same time at half the {what} "
            "(multiply rates by the time between two calls)"
        )
        expect_close(changes, half_step_changes, _SHARE * largest, problem)


def _changes(subject: ControllerUnderTest, steps: dict[str, float]) -> Floats:
    """Return the changes of the commands for zero actions since the first control step, (k, num_envs, dof)."""
    count = subject.count(10)
    per_step = round(subject.control_timestep / steps.get("timestep", subject.control_timestep))
    commands = []
    with replace(subject, **steps).bind() as bound:  # type: ignore[arg-type]
        bound.require_zero()
        bound.displace(_APART)
        for k in range(count * per_step):
            command = np.array(bound.controller.apply(bound.constant(0.0)))
            if bound.controller.rate == "physics":
                for _ in range(bound.decimation - 1):
                    command = np.array(bound.controller.update())
            if (k + 1) % per_step == 0:
                commands.append(bound.last(command))
    return np.array(commands) - commands[0]


@after("zero_action_does_not_drift")
def resets_start_where_the_robot_is(subject: ControllerUnderTest) -> None:
    """If a zero action holds the current position, it holds the position in which the task has placed the robot."""
    with subject.bind() as bound:
        space = bound.require_zero_position()
        home = bound.robot.joint_positions.copy()
        for _ in range(subject.count(12)):
            led = bound.step(bound.constant(0.5 * space.high))
        held = bound.rest(subject.count(50))
        moved = np.abs(bound.last(led) - home).max(axis=1)
        if (np.abs(bound.last(held) - bound.last(led)).max(axis=1) > 0.2 * moved).any() or moved.min() < 0.01:
            raise NotApplicable("a zero action does not hold the current position")
        placed = bound.robot.joint_positions.copy()
        bound.simulation.reset()
        bound.robot.write_joint_state(placed)
        bound.controller.reset(None)
        command = bound.last(bound.controller.apply(bound.constant(0.0)))
        expect_close(
            placed, command, 0.2 * float(moved.min()), "command for a zero action after a reset in another position"
        )


def parts_of_a_robot_are_controlled(subject: ControllerUnderTest) -> None:
    """Bound to a group with some of a robot's joints, the controller commands these joints only."""
    with subject.bind() as bound:
        names = bound.robot.joint_names
    refusals = []
    for name in names[:2] if len(names) > 1 else ():
        try:
            with subject.bind(joints=(name,)) as bound:
                command = np.array(bound.controller.apply(bound.middle()))
                shapes = (NUM_ENVS, 1), (NUM_ENVS, bound.decimation, 1)
                expect(
                    command.shape in shapes,
                    f"a command for the group of joint '{name}' has shape {command.shape}, not {shapes[0]} or "
                    f"{shapes[1]}.",
                )
                finite = bool(np.isfinite(command).all())
                expect(finite, f"a command for the group of joint '{name}' is not finite: {command}.")
        except (ConfigurationError, UnknownNameError) as error:
            refusals.append(str(error))
    if len(refusals) == len(names[:2]):
        raise NotApplicable(f"the controller does not support single joints: {refusals[0]}")


@after("actions_matter")
def parameters_count(subject: ControllerUnderTest) -> None:
    """Every numeric parameter of the constructor affects the commands.

    Parameters of a controller that uses the scene may have an effect only near its bodies.
    """
    cls = subject.record.load()
    silent = []
    expected: Any = None
    for name, parameter in constructor_parameters(cls).items():
        value = subject.kwargs.get(name, parameter.default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < np.inf:
            continue
        expected = _trace(subject) if expected is None else expected
        differs = []
        for factor in (0.5, 2.0, 0.01):
            changed = replace(subject, kwargs={**subject.kwargs, name: type(value)(factor * value)})
            try:
                differs.append(not np.array_equal(expected, _trace(changed)))
            except FrobsError:  # out of range
                continue
            if differs[-1]:
                break
        if differs and not any(differs):
            silent.append(name)
    if expected is None:
        raise NotApplicable("the constructor has no numeric parameters with values above 0")
    problem = f"the commands are the same for other values of {', '.join(silent)}."
    if silent and cls.bind_scene is not Controller.bind_scene and cls.rate == "control":
        raise Inconclusive(problem)
    expect(not silent, problem)


def _trace(subject: ControllerUnderTest) -> Floats:
    with subject.bind(gravity=EARTH) as bound:
        largest, smallest = bound.opposites()
        actions = [largest] * subject.count(8) + [smallest] * subject.count(8) + bound.actions(4, seed=14)
        return np.array([[bound.last(bound.step(action)), bound.robot.joint_positions] for action in actions])
