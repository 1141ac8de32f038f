"""Checks of the controller contract: keyword arguments, spaces, masks, batch rows and snapshots."""

from __future__ import annotations

from copy import deepcopy

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller
from frobs_core.models import JointType
from frobs_core.plugins.records import Level
from frobs_core.util.errors import ConfigurationError
from frobs_devkit.testing.checks import NotApplicable, expect, expect_capability, expect_keyword_only
from frobs_devkit.testing.compare import expect_close, expect_rows, expect_same
from frobs_devkit.testing.controller.under_test import NUM_ENVS, ControllerUnderTest


def keywords_are_keyword_only(subject: ControllerUnderTest) -> None:
    """The implementation is a subclass of Controller, and its constructor has only keyword parameters with defaults."""
    cls = subject.record.load()
    expect(isinstance(cls, type) and issubclass(cls, Controller), f"{cls} is not a subclass of Controller.")
    expect_keyword_only(cls)


def actions_are_normalized(subject: ControllerUnderTest) -> None:
    """The action space is a float32 Box within [−1, 1] or a discrete space."""
    with subject.bind() as bound:
        space = bound.controller.action_space
        if isinstance(space, gym.spaces.Box):
            expect(
                space.dtype == np.float32,
                f"the dtype of the action space is {space.dtype}; it must be float32, because learners send float32 "
                "actions.",
            )
            expect(space.low.min() >= -1 and space.high.max() <= 1, f"{space} is not within [−1, 1].")
        else:
            discrete = gym.spaces.Discrete | gym.spaces.MultiDiscrete | gym.spaces.MultiBinary
            expect(isinstance(space, discrete), f"{space} is neither a Box nor discrete.")


def commands_have_the_order_of_the_group(subject: ControllerUnderTest) -> None:
    """Reversing the order of the joints in a group reverses the order of the controller's commands."""
    commands = []
    for reverse in (False, True):
        try:
            with subject.bind(reverse=reverse) as bound:
                if not isinstance(bound.controller.action_space, gym.spaces.Box):
                    raise NotApplicable(
                        "the action space is discrete, and a discrete action may move the same joint regardless of the "
                        "joint order"
                    )
                actions = [bound.constant(value) for value in (0.0, 1.0, -1.0)]
                commands.append([np.array(bound.controller.apply(action)) for action in actions])
        except ConfigurationError as error:
            raise NotApplicable(f"the controller does not support this joint group: {error}") from error
    for straight, reversed_ in zip(*commands, strict=True):
        tolerance = 1e-9 * max(1.0, float(np.abs(straight).max()))
        expect_close(straight[..., ::-1], reversed_, tolerance, "commands of a joint group in reverse order")


def actions_have_the_order_of_the_group(subject: ControllerUnderTest) -> None:
    """If each action element moves a single joint, element i moves joint i of the group, regardless of joint names.

    All elements have the same sign: either larger elements move all joints forward, or all joints backward.
    """
    for reverse in (False, True):
        try:
            with subject.bind(reverse=reverse) as bound:
                space, names = bound.controller.action_space, bound.robot.joint_names[:: -1 if reverse else 1]
                if not isinstance(space, gym.spaces.Box) or space.low.size != len(names):
                    raise NotApplicable("the action does not have one element for each joint")
                if all(joint.type is JointType.PRISMATIC for joint in bound.robot.joints):
                    raise NotApplicable(
                        "all joints are prismatic, so action elements may refer to Cartesian axes instead of joints"
                    )
                changes = np.zeros((len(names), len(names)))  # of the commands between both bounds of each element
                for number in range(len(names)):
                    low, high = (bound.controller.apply(action).copy() for action in bound.extremes(number))
                    changes[number] = (high - low).reshape(-1, len(names)).sum(axis=0)
        except ConfigurationError as error:
            raise NotApplicable(f"the controller does not support this joint group: {error}") from error
        moved = changes != 0.0
        if (moved.sum(axis=0) != 1).any() or (moved.sum(axis=1) != 1).any():
            raise NotApplicable("the elements of an action do not correspond one-to-one to the joints")
        for number, column in enumerate(moved.argmax(axis=1)):
            expect(
                number == column,
                f"element {number} of an action moves joint '{names[column]}' of the group {', '.join(names)}, but "
                f"it must move '{names[number]}'; use the joint order of JointGroup.joint_names.",
            )
        signs = np.sign(changes.diagonal())
        expect(
            (signs == signs[0]).all(),
            f"larger actions move some joints forward and others backward: the signs are {signs} for the joints "
            f"{', '.join(names)}.",
        )


def commands_have_their_shape(subject: ControllerUnderTest) -> None:
    """Commands are finite and have the shape (num_envs, dof) or (num_envs, decimation, dof)."""
    with subject.bind() as bound:
        expect(isinstance(bound.controller.command_mode, CommandMode), "command_mode is not a CommandMode.")
        n, dof = NUM_ENVS, bound.robot.dof
        for action in bound.actions(subject.count(20), seed=1):
            command = np.array(bound.controller.apply(action))
            right = command.shape in ((n, dof), (n, bound.decimation, dof))
            expect(right, f"a command has shape {command.shape}, neither {(n, dof)} nor {(n, bound.decimation, dof)}.")
            expect(np.isfinite(command).all(), f"a command is not finite: {command}.")
            bound.robot.command(command)
            bound.advance()


def info_has_its_shape(subject: ControllerUnderTest) -> None:
    """``info`` returns the same keys at every step, each with an array of finite numbers of shape (num_envs,)."""
    if subject.record.load().info is Controller.info:
        raise NotApplicable("the controller reports no info keys")
    with subject.bind() as bound:
        known: set[str] | None = None
        for action in bound.actions(subject.count(5), seed=13):
            bound.step(action)
            info = bound.controller.info()
            expect(
                known in (None, set(info)),
                f"info() returned the keys {sorted(info)}, but {sorted(known or ())} at an earlier step; the keys "
                "must not change.",
            )
            known = set(info)
            for name, values in info.items():
                right = isinstance(values, np.ndarray) and values.shape == (NUM_ENVS,) and values.dtype.kind in "fiub"
                expect(right, f"info()['{name}'] is not an array of numbers of shape ({NUM_ENVS},): {values!r}.")
                expect(bool(np.isfinite(values).all()), f"info()['{name}'] is not finite: {values}.")


def actions_are_clipped(subject: ControllerUnderTest) -> None:
    """An action outside a Box space has the same effect as the nearest action inside the space."""
    commands = []
    for scale in (1.0, 5.0):
        with subject.bind() as bound:
            space = bound.controller.action_space
            if not isinstance(space, gym.spaces.Box):
                raise NotApplicable("the action space is discrete")
            commands.append([bound.step(bound.constant(scale * space.high)) for _ in range(3)])
    what = "commands for actions five times larger than the upper bound, compared with commands for the upper bound"
    expect_same(commands[0], commands[1], what)


def action_changes_are_followed(subject: ControllerUnderTest) -> None:
    """If the action changes by ``max_action_change``, the command changes as fast as the velocity limits allow."""
    with subject.bind() as bound:
        change, space, robot = bound.controller.max_action_change, bound.controller.action_space, bound.robot
        if change is None or not isinstance(space, gym.spaces.Box) or space.low.size != robot.dof:
            raise NotApplicable("the controller does not define a max_action_change for its joints")
        middle = (space.low.astype(np.float64) + space.high) / 2.0
        for _ in range(1 + subject.count(100)):
            before = bound.step(bound.constant(middle))
        # fraction of max_action_change that keeps the action within the action space
        share = np.minimum(0.5, (space.high - middle) / change)
        after = bound.step(bound.constant(middle + share * np.where(np.isfinite(change), change, 0.0)))
        moved = bound.last(after - before)
        allowed = robot.velocity_limit * subject.control_timestep
        limited = np.isfinite(change) & np.isfinite(allowed[0])
        expected = np.where(limited, share * allowed, np.abs(moved))
        what = (
            "change of the command when the action changes by a fraction of max_action_change, compared with the "
            "same fraction of velocity_limit × control_timestep"
        )
        expect_close(expected, np.abs(moved), 1e-3 * float(allowed[:, limited].max(initial=1e-9)), what)


def apply_reads_only(subject: ControllerUnderTest) -> None:
    """``apply`` modifies neither the given actions nor the simulation."""
    with subject.bind() as bound:
        for action in bound.actions(subject.count(5), seed=6):
            given = 3 * action if isinstance(bound.controller.action_space, gym.spaces.Box) else action
            copy = given.copy()
            state = deepcopy(bound.simulation.snapshot())
            command = np.array(bound.controller.apply(given))
            expect_same(copy, given, "the array of actions after apply()")
            expect_same(state, bound.simulation.snapshot(), "the simulation after apply()")
            bound.robot.command(command)
            bound.advance()


def needs_are_capabilities(subject: ControllerUnderTest) -> None:
    """The record's ``needs`` contains only existing capabilities, each with a level."""
    for capability, level in subject.record.needs.items():
        expect_capability(capability)
        right = isinstance(level, Level)
        expect(right, f"the record's 'needs' has the value {level!r} for '{capability}'; expected a Level.")


def controllers_share_nothing(subject: ControllerUnderTest) -> None:
    """A second controller that runs at the same time does not affect the first controller."""
    with subject.bind() as bound:
        actions = bound.actions(subject.count(8), seed=11)
        expected = [bound.step(action) for action in actions]
    with subject.bind() as bound, subject.bind() as other:
        others = other.actions(subject.count(8), seed=12)
        for k, (action, distraction) in enumerate(zip(actions, others, strict=True)):
            other.step(distraction)
            expect_same(expected[k], bound.step(action), f"command {k + 1} while another controller works")


def reset_honours_the_mask(subject: ControllerUnderTest) -> None:
    """A reset affects only the environments that its mask selects."""
    mask = np.arange(NUM_ENVS) == 0
    with subject.bind() as bound, subject.bind() as other, subject.bind() as fresh:
        history = bound.actions(subject.count(12), seed=4)
        for one in (bound, other):
            for action in history:
                one.step(action)
        bound.begin(mask)
        for action in bound.actions(subject.count(5), seed=5):
            partly_reset, kept, anew = bound.step(action), other.step(action), fresh.step(action)
            expect_same(kept[1:], partly_reset[1:], "commands of environments that were not reset")
            expect_same(anew[0], partly_reset[0], "commands of the reset environment, compared with a new controller")


def rows_equal_singles(subject: ControllerUnderTest) -> None:
    """With the same actions, environment i of a batch receives the same commands as a single environment."""
    with subject.bind() as bound:
        actions = bound.actions(subject.count(25), seed=7)
        expected = [bound.step(action) for action in actions]
    for i in range(NUM_ENVS):
        with subject.bind(num_envs=1) as bound:
            for k, action in enumerate(actions):
                what = f"command of a single environment compared with row {i} of {NUM_ENVS}, step {k + 1}"
                expect_same(expected[k][[i]], bound.step(action[[i]]), what)


def snapshots_continue(subject: ControllerUnderTest) -> None:
    """After a controller and its simulation are restored from snapshots, the commands repeat exactly."""
    with subject.bind() as bound:
        for action in bound.actions(subject.count(9), seed=8):
            bound.step(action)
        # not copied here, because the controller's snapshot must already be a copy
        state = deepcopy(bound.simulation.snapshot()), bound.controller.snapshot()
        expect_rows(state[1], NUM_ENVS, "snapshot()")
        actions = bound.actions(subject.count(9), seed=9)
        expected = [bound.step(action) for action in actions]
        bound.simulation.restore(deepcopy(state[0]))
        bound.controller.restore(deepcopy(state[1]))
        expect_same(expected, [bound.step(action) for action in actions], "commands after a restore")
    with subject.bind() as bound:
        bound.simulation.restore(deepcopy(state[0]))
        bound.controller.restore(deepcopy(state[1]))
        expect_same(expected, [bound.step(action) for action in actions], "commands of a new, restored controller")
