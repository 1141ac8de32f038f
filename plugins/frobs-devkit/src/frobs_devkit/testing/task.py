"""Checks of a task, in an environment that it is part of."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing, suppress
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core import plugins
from frobs_core.capabilities import abilities
from frobs_core.errors import ConfigurationError, FrobsError, MissingSettingError
from frobs_core.interfaces import Marker, Scene, Task
from frobs_core.registry import COMPOSITIONAL_ID
from frobs_core.specs import TaskRecord
from frobs_devkit.testing.checks import (
    Check,
    CheckFailure,
    NotApplicable,
    checks_of,
    collect,
    expect,
    expect_keyword_only,
    expect_raises,
)
from frobs_devkit.testing.compare import expect_array, expect_same
from frobs_devkit.testing.environment import api, data, honesty, life, rewards, seeding, state, vector
from frobs_devkit.testing.environment.rollout import draw_actions, expect_same_play, play
from frobs_devkit.testing.environment.subject import EnvUnderTest, achieved_goal, inside


@dataclass(frozen=True, eq=False)
class TaskUnderTest(EnvUnderTest):
    """An environment, with the record of its task."""

    record: TaskRecord = field(kw_only=True)


def record_is_sound(subject: TaskUnderTest) -> None:
    """It is a Task whose constructor takes keyword-only parameters with defaults, and its needs are capabilities."""
    cls = subject.record.load()
    expect(isinstance(cls, type) and issubclass(cls, Task), f"{cls} is no subclass of Task.")
    expect_keyword_only(cls)
    for capability in subject.record.needs:
        expect(capability in abilities(), f"it needs '{capability}', which is no capability.")
    scene = cls().scene()
    expect(isinstance(scene, Scene), "scene() returns no Scene.")
    declared = "contacts" in subject.record.needs or not scene.contacts
    expect(
        declared, f"its scene has the contacts {', '.join(scene.contacts)}, and its record does not need 'contacts'."
    )


def reward_types_work(subject: TaskUnderTest) -> None:
    """Every reward_type makes an environment; ``sparse`` takes two values at most; another is refused."""
    for reward_type in subject.record.load().reward_types:
        with closing(subject.make(reward_type=reward_type)) as env:
            env.reset(seed=0)
            seen = {float(env.step(action)[1]) for action in draw_actions(env.action_space, 20, seed=0)}
            expect(np.isfinite(list(seen)).all(), f"reward_type '{reward_type}' gives a reward that is not finite.")
            expect(
                reward_type != "sparse" or len(seen) <= 2,
                f"the sparse reward takes {len(seen)} values: {sorted(seen)}.",
            )
    with expect_raises(ConfigurationError, "reward_type='no_such_reward_type'"):
        subject.make(reward_type="no_such_reward_type").close()


def reset_needs_are_stated(subject: TaskUnderTest) -> None:
    """A reset writes no state, not even for the option ``joint_positions``, unless the task says that it needs ``teleport``."""
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
    """Call the reset of a task with handles that refuse to be written to, as those of some simulators do."""
    names = [(handle, name) for handle in handles for name in dir(handle) if name.startswith("write_")]
    for handle, name in names:
        setattr(handle, name, partial(_refuse, name))
    try:
        reset(*arguments)
    finally:
        for handle, name in names:
            delattr(handle, name)


def _refuse(name: str, *arguments: Any, **keywords: Any) -> None:
    raise CheckFailure(f"a reset calls {name}, and neither the task's record nor its reset_needs() names 'teleport'.")


def batch_has_its_shapes(subject: TaskUnderTest) -> None:
    """Rewards, terms, ends and success have a row for each environment; marks have places."""
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
            expect(isinstance(mark, Marker) and mark.pos.shape == (3, 3), f"a marker is {mark}, not at (num_envs, 3).")


def observation_terms_are_sound(subject: TaskUnderTest) -> None:
    """Every term has a unit and ordered bounds, reads the same twice, and is in its columns of the observation."""
    with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as env:
        env.reset(seed=0)
        env.step(draw_actions(env.action_space, 1, seed=0)[0])
        observations = inside(env).observations
        observation = observations.observe()
        for name, term in observations.terms.items():
            what = f"the observation term '{name}'"
            expect(isinstance(term.unit, str) and bool(term.unit), f"{what} has no unit; use '1' for a plain number.")
            expect((term.low <= term.high).all(), f"{what} has a lowest value above its highest.")
            value = term.read()
            expect(value.shape == (3, *term.low.shape), f"{what} reads {value.shape}, not {(3, *term.low.shape)}.")
            before = value.copy()
            expect_same(before, np.array(term.read()), f"{what}, read again")
            key, columns = observations.columns[name]
            part = observation[key] if isinstance(observation, dict) else observation
            expect_same(before.astype(term.dtype), part[:, columns], f"{what}, in its columns of the observation")


def reading_changes_nothing(subject: TaskUnderTest) -> None:
    """Reward, terms, ends, success and marks can be read again: the same numbers, and the episode goes on the same.

    This also holds if the goal is achieved at the beginning of the episode.
    """
    for there in (False, True):
        plays = []
        for curious in (False, True):
            with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as env:
                trace: list[Any] = [deepcopy(env.reset(seed=4)[0])]
                if there:
                    with suppress(FrobsError, ValueError):  # where it cannot be a goal
                        trace.append(deepcopy(env.reset(seed=4, options={"goal": achieved_goal(env, trace[0])})[0]))
                for action in draw_actions(env.action_space, 12, seed=4):
                    trace.append(deepcopy(env.step(action)[:4]))
                    if curious and not (trace[-1][2] | trace[-1][3]).any():
                        _read_twice(inside(env), trace[-1][1])
                plays.append(trace)
        for k, (quiet, read) in enumerate(zip(*plays, strict=True)):
            expect_same(quiet, read, f"step {k} where reward, ends and terms were read once more")


def default_timestep_is_a_default(subject: TaskUnderTest) -> None:
    """Once it is bound, a task computes with the ``control_timestep`` that ``bind`` was given, not with its class's."""
    subject.require_pause()
    plays = []
    for other in (False, True):
        with closing(subject.make()) as env:
            task = inside(env).task
            if other and "control_timestep" not in vars(task):  # else it is the one that bind has kept
                task.control_timestep = 2.0 * type(task).control_timestep
            plays.append(play(env, 4, draw_actions(env.action_space, 12, seed=4)))
    what = "where the class's control_timestep is another once the task is bound (use the argument of bind)"
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
    *checks_of(data, seeding, rewards, state),
    life.reset_options_hold,
    life.options_hold_by_row,
    honesty.step_shows_its_action,
    honesty.ends_have_their_reason,
    vector.same_step_equals_single,
    vector.disabled_equals_single,
)
"""Every check of a task, in the order in which they run."""


def check_task(task: str | TaskRecord, **kwargs: Any) -> list[Check]:
    """Return the checks of a task.

    Args:
        task: Its name, or a record that is not installed yet.
        **kwargs: Keywords of the environment that it is tried in: ``robot=``, ``controller=``, parameters. What is
            left out is taken from the first environment ID that the task registers.

    Raises:
        UnknownNameError: No task has this name.
        ConfigurationError: The task registers no ID, and neither ``robot`` nor ``controller`` was given.
    """
    record = plugins.get_record("task", task) if isinstance(task, str) else task
    assert isinstance(record, TaskRecord)
    parts: Mapping[str, Any] = {}
    if record.environments:
        first = record.environments[0]
        parts = {"robot": first.robot, "controller": first.controller, "simulator": first.simulator, **first.parameters}
    elif not {"robot", "controller"} <= kwargs.keys():
        raise MissingSettingError("check_task", "robot= and controller=", f"task '{record.name}' registers no ID")
    return collect(TaskUnderTest(COMPOSITIONAL_ID, {"task": task, **parts, **kwargs}, record=record), CHECKS)
