"""Checks of a task, in an environment that it is part of."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core import plugins
from frobs_core.capabilities import CAPABILITIES
from frobs_core.errors import ConfigurationError, MissingSettingError
from frobs_core.interfaces import Marker, Scene, Task
from frobs_core.random import RandomSource
from frobs_core.registry import COMPOSITIONAL_ID
from frobs_core.specs import TaskRecord
from frobs_devkit.testing.checks import Check, CheckFailure, Outcome, collect, expect
from frobs_devkit.testing.compare import leaves
from frobs_devkit.testing.environment import api, data, honesty, life, rewards, seeding, state, vector
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.subject import EnvUnderTest, inside
from frobs_devkit.testing.task_terms import columns_fit_the_observation, reading_changes_nothing


@dataclass(frozen=True, eq=False)
class TaskUnderTest(EnvUnderTest):
    """An environment, with the record of its task."""

    record: TaskRecord = field(kw_only=True)


def record_is_sound(subject: TaskUnderTest) -> Outcome:
    """It is a Task whose constructor takes keyword-only parameters with defaults, and its needs are capabilities."""
    cls = subject.record.load()
    expect(isinstance(cls, type) and issubclass(cls, Task), f"{cls} is no subclass of Task.")
    for name, parameter in inspect.signature(cls).parameters.items():
        expect(
            parameter.kind is inspect.Parameter.KEYWORD_ONLY and parameter.default is not inspect.Parameter.empty,
            f"the constructor's parameter '{name}' is not keyword-only with a default; users give it by name or not at all.",
        )
    for capability in subject.record.needs:
        expect(capability in CAPABILITIES, f"it needs '{capability}', which is no capability.")
    expect(isinstance(cls().scene(), Scene), "scene() returns no Scene.")
    return None


def reward_types_work(subject: TaskUnderTest) -> Outcome:
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
    try:
        subject.make(reward_type="no_such_reward_type").close()
    except ConfigurationError:
        return None
    raise CheckFailure("reward_type='no_such_reward_type' passes; it must raise ConfigurationError.")


def batch_has_its_shapes(subject: TaskUnderTest) -> Outcome:
    """Rewards, terms, ends and success have a row for each environment; observations are float32; marks have places."""
    with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as env:
        env.reset(seed=0)
        env.step(draw_actions(env.action_space, 1, seed=0)[0])
        task, rng = inside(env).task, RandomSource(3)
        ends = task.is_terminated()
        arrays = {
            "reward()": (task.reward(), np.float64),
            "is_success()": (task.is_success(), np.bool_),
            **({} if ends is None else {"is_terminated()": (ends, np.bool_)}),
            **{f"reward_terms()['{name}']": (term, np.float64) for name, term in task.reward_terms().items()},
        }
        for name, (array, dtype) in arrays.items():
            found = f"{array.dtype}{list(array.shape)}"
            expect(found == f"{np.dtype(dtype)}[3]", f"{name} is {found}, not {np.dtype(dtype)}[3].")
        for path, leaf in leaves(task.observe(rng)).items():
            expect(leaf.dtype == np.float32 and len(leaf) == 3, f"observe(){path} is {leaf.dtype}{list(leaf.shape)}, not "
                   "float32 with a row for each environment.")  # fmt: skip
        for mark in task.markers():
            expect(isinstance(mark, Marker) and mark.pos.shape == (3, 3), f"a marker is {mark}, not at (num_envs, 3).")
    return None


CHECKS = (
    record_is_sound,
    reward_types_work,
    batch_has_its_shapes,
    columns_fit_the_observation,
    reading_changes_nothing,
    api.unknown_keyword_refused,
    data.spaces_hold,
    data.values_finite,
    data.observations_share_no_memory,
    data.observation_elements_vary,
    seeding.same_seed_repeats,
    seeding.seeds_differ,
    seeding.episodes_differ,
    seeding.reset_forgets_history,
    life.reset_options_hold,
    honesty.step_shows_its_action,
    honesty.ends_have_their_reason,
    rewards.success_in_every_step,
    rewards.terms_sum_to_reward,
    rewards.compute_reward_equals_step,
    state.snapshot_continues,
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
        raise MissingSettingError(
            "check_task", "robot= and controller=", f"task '{record.name}' registers no environment ID"
        )
    return collect(TaskUnderTest(COMPOSITIONAL_ID, {"task": task, **parts, **kwargs}, record=record), CHECKS)
