"""Checks of the robot motion that a controller produces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode
from frobs_devkit.testing.checks import Inconclusive, after, expect
from frobs_devkit.testing.compare import difference, expect_close
from frobs_devkit.testing.controller.under_test import EARTH, NUM_ENVS, ControllerUnderTest


def actions_matter(subject: ControllerUnderTest) -> None:
    """Actions that differ in any element produce different commands, and the robot moves."""
    with subject.bind() as bound:
        space = bound.controller.action_space
        start = bound.robot.joint_positions.copy()
        traces = []
        for action in bound.opposites():
            bound.begin()
            traces.append([bound.step(action) for _ in range(subject.count(10))])
        expect(not np.array_equal(traces[0], traces[1]), "the minimum and the maximum action give the same commands.")
        if isinstance(space, gym.spaces.Box):
            for number in range(space.low.size):
                low, high = ([bound.step(action) for _ in range(2)] for action in bound.extremes(number))
                different = not np.array_equal(low, high)
                expect(different, f"element {number} of an action has no effect on the commands.")
        if np.abs(bound.robot.joint_positions - start).max() <= 1e-4:
            raise Inconclusive("nothing moved")


@after("actions_matter")
def actions_act_in_their_step(subject: ControllerUnderTest) -> None:
    """The command in a control step depends on the action in the same step. Only ``randomize`` adds delays."""
    commands = []
    with subject.bind() as bound:
        for action in bound.opposites():
            bound.begin()
            # also compare positions, because a controller may use the action in update() but not in apply()
            commands.append((bound.step(action), bound.robot.joint_positions.copy()))
    expect(
        difference(*commands) is not None,
        "the first command of an episode is the same for opposite actions, so the controller uses the action of the "
        "previous step; it must use the action of the current step.",
    )


def zero_action_rests(subject: ControllerUnderTest) -> None:
    """Without gravity, zero actions bring the robot to rest and keep it there."""
    with subject.bind() as bound:
        bound.require_zero()
        bound.rest(subject.count(75))
        at_rest = np.zeros_like(bound.robot.joint_velocities)
        expect_close(at_rest, bound.robot.joint_velocities, 0.02, "joint velocities after 3 s of zero actions")


def zero_action_does_not_drift(subject: ControllerUnderTest) -> None:
    """Under gravity, a position controller's zero action holds the robot without drift.

    If the zero action holds the current position, it must also hold positions reached with other actions.
    """
    with subject.bind(gravity=EARTH) as bound:
        space, robot = bound.require_zero_position(), bound.robot
        bound.rest(subject.count(50))
        before = robot.joint_positions.copy()
        bound.rest(subject.count(50))
        expect_close(before, robot.joint_positions, 2e-3, "joint positions after 4 s, compared with those after 2 s")
        bound.begin()
        start = robot.joint_positions.copy()
        bound.rest(1)
        # if the robot moves, the zero action commands a fixed position
        if np.abs(robot.joint_positions - start).max() < 0.02:
            for _ in range(subject.count(12)):
                bound.step(bound.constant(0.5 * space.high))
            led = robot.joint_positions - start
            bound.rest(subject.count(50))
            kept = np.abs(bound.robot.joint_positions - start).max(axis=1)
            expect(
                (kept >= 0.5 * np.abs(led).max(axis=1)).all(),
                "zero actions undo the previous actions: the joints return toward their initial positions.",
            )


@after("zero_action_does_not_drift")
def commands_stay_in_limits(subject: ControllerUnderTest) -> None:
    """For any action, the commands and the joint positions stay within the joint limits.

    In each control step, a position command changes by no more than the joint's velocity limit allows. If the limit
    determines the change, this also holds for half the time between two actions.
    """
    limited = _expect_limits(subject)
    if limited and subject.decimation % 2 == 0:
        _expect_limits(replace(subject, timestep=0.5 * subject.control_timestep))


def _expect_limits(subject: ControllerUnderTest) -> bool:
    """Check the limits, and return whether a velocity limit determined the change of a command."""
    limited = False
    with subject.bind() as bound:
        space, robot = bound.controller.action_space, bound.robot
        mode = bound.controller.command_mode
        upper = {
            CommandMode.POSITION: robot.position_upper,
            CommandMode.VELOCITY: robot.velocity_limit,
            CommandMode.EFFORT: robot.effort_limit,
        }[mode]
        lower = robot.position_lower if mode is CommandMode.POSITION else -upper
        extremes: list[Any] = bound.actions(subject.count(60), seed=3)
        if isinstance(space, gym.spaces.Box):
            corners = [space.low, space.high, np.where(np.arange(space.low.size) % 2, space.low, space.high)]
            extremes = [bound.constant(corner) for corner in corners for _ in range(subject.count(50))]
        before = robot.joint_positions.copy()
        for action in extremes:
            command = bound.step(action).reshape(NUM_ENVS, -1, robot.dof)
            inside = (command >= lower[:, None] - 1e-9) & (command <= upper[:, None] + 1e-9)
            expect(inside.all(), f"a {mode} command exceeds the limits of joint "
                   f"'{robot.joint_names[int(np.argwhere(~inside)[0][2]) if not inside.all() else 0]}': "
                   f"{command[:, -1]}.")  # fmt: skip
            if mode is CommandMode.POSITION:
                reach = robot.velocity_limit * subject.control_timestep
                expect(
                    (np.abs(command[:, -1] - before) <= reach * (1.0 + 1e-6)).all(),
                    "a position command differs from the previous command by more than the velocity limit allows in "
                    "one control step.",
                )
                limited |= bool((np.abs(command[:, -1] - before) > 0.99 * reach).any())
                before = command[:, -1]
                q = robot.joint_positions
                over = np.maximum(robot.position_lower - q, q - robot.position_upper)
                expect(over.max() < 0.1, f"the robot exceeds its joint limits by {over.max():.3g}.")
    return limited
