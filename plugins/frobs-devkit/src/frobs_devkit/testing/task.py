"""Conformance checks for a task in an environment."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing, suppress
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core.contracts import Task
from frobs_core.description import Marker, Scene
from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins.records import TaskRecord
from frobs_core.plugins.registry import COMPOSITIONAL_ID
from frobs_core.util.errors import ConfigurationError, FrobsError, MissingSettingError
from frobs_devkit.testing.checks import (
    Check,
    CheckFailure,
    NotApplicable,
    checks_in,
    collect,
    expect,
    expect_capability,
    expect_keyword_only,
    expect_raises,
)
from frobs_devkit.testing.compare import expect_array, expect_same
from frobs_devkit.testing.environment import api, lifecycle, step_results, vector
from frobs_devkit.testing.environment.rollout import draw_actions, expect_same_play, play
from frobs_devkit.testing.environment.under_test import EnvUnderTest, achieved_goal, inside


@dataclass(frozen=True, eq=False)
class TaskUnderTest(EnvUnderTest):
    """An environment, together with the record of its task."""

    record: TaskRecord = field(kw_only=True)


def record_is_sound(subject: TaskUnderTest) -> None:
    """The implementation is a Task, its parameters are keyword-only and have defaults, and FRobs knows every capability that it requires."""
    cls = subject.record.load()
    expect(isinstance(cls, type) and issubclass(cls, Task), f"{cls} is not a subclass of Task.")
    expect_keyword_only(cls)
    for capability in subject.record.needs:
        expect_capability(capability)
    scene = cls().scene()
    expect(isinstance(scene, Scene), "scene() does not return a Scene.")
    declared = "contacts" in subject.record.needs or not scene.contacts
    expect(
        declared,
        f"the task's scene has the contacts {', '.join(scene.contacts)}, but the record's 'needs' does not contain "
        "'contacts'.",
    )


def reward_types_work(subject: TaskUnderTest) -> None:
    """Every declared reward type works, ``sparse`` has at most two values, and unknown reward types are rejected."""
    for reward_type in subject.record.load().reward_types:
        with closing(subject.make(reward_type=reward_type)) as env:
            env.reset(seed=0)
            seen = {float(env.step(action)[1]) for action in draw_actions(env.action_space, 20, seed=0)}
            expect(np.isfinite(list(seen)).all(), f"reward_type '{reward_type}' gives a reward that is not finite.")
            expect(
                reward_type != "sparse" or len(seen) <= 2,
                f"the sparse reward has {len(seen)} values: {sorted(seen)}.",
            )
    with expect_raises(ConfigurationError, "reward_type='no_such_reward_type'"):
        subject.make(reward_type="no_such_reward_type").close()


def reset_needs_are_stated(subject: TaskUnderTest) -> None:
    """A reset writes states only if the task's ``needs`` or ``reset_needs()`` contains ``teleport``."""
    with closing(subject.make()) as env:
        task, robot = inside(env).task, inside(env).robot
        ways: list[dict[str, Any]] = [{}]
        if "joint_positions" in task.reset_options:
            ways.append({"joint_positions": robot.home[0]})
        silent = [options for options in ways if "teleport" not in {*subject.record.needs, *task.reset_needs(options)}]
        if not silent:
            raise NotApplicable("every reset of the task needs 'teleport'")
        reset = task.reset
        for options in silent:
            task.reset = partial(_without_writes, reset, [robot, *inside(env).simulation.bodies.values()])
            env.reset(seed=0, options=options)


def _without_writes(reset: Any, handles: list[Any], *arguments: Any) -> None:
    """Call a task's reset with handles that reject writes, as in simulators without ``teleport``."""
    names = [(handle, name) for handle in handles for name in dir(handle) if name.startswith("write_")]
    for handle, name in names:
        setattr(handle, name, partial(_refuse, name))
    try:
        reset(*arguments)
    finally:
        for handle, name in names:
            delattr(handle, name)


def _refuse(name: str, *arguments: Any, **keywords: Any) -> None:
    raise CheckFailure(
        f"a reset calls {name}, but neither the task's record nor its reset_needs() contains 'teleport'."
    )


def batch_has_its_shapes(subject: TaskUnderTest) -> None:
    """Rewards, reward terms, terminations, success and markers have one row for each environment."""
    with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as env:
        env.reset(seed=0)
        env.step(draw_actions(env.action_space, 1, seed=0)[0])
        task = inside(env).task
        ends = task.is_terminated()
        arrays = {
            "reward()": (task.reward(inside(env).step_context), np.float64),
            "is_success()": (task.is_success(), np.bool_),
            **({} if ends is None else {"is_terminated()": (ends, np.bool_)}),
            **{f"reward_terms()['{name}']": (term, np.float64) for name, term in task.reward_terms().items()},
        }
        for name, (array, dtype) in arrays.items():
            expect_array(array, (3,), dtype, name)
        for mark in task.markers():
            expect(
                isinstance(mark, Marker) and mark.pos.shape == (3, 3),
                f"a marker is {mark}; expected a Marker with positions of shape (num_envs, 3).",
            )


def observation_terms_are_sound(subject: TaskUnderTest) -> None:
    """Every observation term has a unit and ordered bounds, can be read repeatedly, and fills its own columns."""
    with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as env:
        env.reset(seed=0)
        env.step(draw_actions(env.action_space, 1, seed=0)[0])
        observations = inside(env).observations
        observation = observations.observe()
        for name, term in observations.terms.items():
            what = f"the observation term '{name}'"
            expect(isinstance(term.unit, str) and bool(term.unit), f"{what} has no unit; use '1' for a plain number.")
            expect((term.low <= term.high).all(), f"{what} has a lower bound above its upper bound.")
            value = term.read()
            expect(value.shape == (3, *term.low.shape), f"{what} reads {value.shape}, not {(3, *term.low.shape)}.")
            before = value.copy()
            expect_same(before, np.array(term.read()), f"{what}, read again")
            key, columns = observations.columns[name]
            part = observation[key] if isinstance(observation, dict) else observation
            expect_same(
                before.astype(term.dtype), part[:, columns], f"{what}, compared with its columns of the observation"
            )


def reading_changes_nothing(subject: TaskUnderTest) -> None:
    """Reading the reward, its terms, terminations, success and markers again does not affect the episode.

    This also holds if the goal is already achieved when the episode begins.
    """
    for there in (False, True):
        plays = []
        for curious in (False, True):
            with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as env:
                trace: list[Any] = [deepcopy(env.reset(seed=4)[0])]
                if there:
                    with suppress(FrobsError, ValueError):  # the task may reject the achieved goal as a desired goal
                        trace.append(deepcopy(env.reset(seed=4, options={"goal": achieved_goal(env, trace[0])})[0]))
                for action in draw_actions(env.action_space, 12, seed=4):
                    trace.append(deepcopy(env.step(action)[:4]))
                    if curious and not (trace[-1][2] | trace[-1][3]).any():
                        _read_twice(inside(env), trace[-1][1])
                plays.append(trace)
        for k, (quiet, read) in enumerate(zip(*plays, strict=True)):
            expect_same(quiet, read, f"step {k}, in which the reward, terminations and terms were read again")


def default_timestep_is_a_default(subject: TaskUnderTest) -> None:
    """After ``bind``, a task uses the ``control_timestep`` argument of ``bind`` instead of the class attribute."""
    subject.require_pause()
    plays = []
    for other in (False, True):
        with closing(subject.make()) as env:
            task = inside(env).task
            # if the instance has its own control_timestep, bind() has stored its argument there
            if other and "control_timestep" not in vars(task):
                task.control_timestep = 2.0 * type(task).control_timestep
            plays.append(play(env, 4, draw_actions(env.action_space, 12, seed=4)))
    what = "an environment whose task has another class attribute control_timestep (use the argument of bind instead)"
    expect_same_play(plays[0], plays[1], what)


def _read_twice(env: Any, reward: Any) -> None:
    task, read_reward = env.task, partial(env.task.reward, env.step_context)
    for what, read in {"reward()": read_reward, "is_success()": task.is_success}.items():
        expect_same(np.array(read()), np.array(read()), f"{what}, read again")
    expect_same(np.asarray(reward, np.float64), np.array(read_reward()), "reward() against the step's reward")
    task.reward_terms()
    task.is_terminated()
    task.markers()
    task.snapshot()


CHECKS = (
    record_is_sound,
    reward_types_work,
    reset_needs_are_stated,
    batch_has_its_shapes,
    observation_terms_are_sound,
    reading_changes_nothing,
    default_timestep_is_a_default,
    api.unknown_keyword_refused,
    *checks_in("frobs_devkit.testing.environment", "outputs seeding rewards success"),
    lifecycle.reset_options_hold,
    lifecycle.options_hold_by_row,
    step_results.step_shows_its_action,
    step_results.ends_have_their_reason,
    vector.same_step_equals_single,
    vector.disabled_equals_single,
)
"""All task checks, in the order in which they run."""


def check_task(task: str | TaskRecord, **kwargs: Any) -> list[Check]:
    """Return the conformance checks for a task.

    Args:
        task: Name of an installed task, or the record of a task that is not installed yet.
        **kwargs: Keyword arguments of the environment, such as ``robot=``, ``controller=`` and parameters. Omitted
            arguments are taken from the first environment ID that the task registers.

    Raises:
        UnknownNameError: No task has this name.
        ConfigurationError: The task does not register an ID, and ``robot`` or ``controller`` is missing.
    """
    record = find_record(TaskRecord, task)
    parts: Mapping[str, Any] = {}
    if record.environments:
        first = record.environments[0]
        parts = {"robot": first.robot, "controller": first.controller, "simulator": first.simulator, **first.parameters}
    elif not {"robot", "controller"} <= kwargs.keys():
        raise MissingSettingError(
            "check_task", "robot= and controller=", f"task '{record.name}' does not register an environment ID"
        )
    return collect(TaskUnderTest(COMPOSITIONAL_ID, {"task": task, **parts, **kwargs}, record=record), CHECKS)
