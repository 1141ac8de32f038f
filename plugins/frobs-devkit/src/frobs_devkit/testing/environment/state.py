"""Checks that snapshots are complete."""

from __future__ import annotations

from contextlib import closing
from copy import deepcopy
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_devkit.testing.checks import after
from frobs_devkit.testing.compare import expect_rows, expect_same
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.under_test import EnvUnderTest, inside, require_ours

_NUM_ENVS = 3


@after("same_seed_repeats")
def snapshot_continues(subject: EnvUnderTest) -> None:
    """After a snapshot is restored, a batch continues as before, even in a new batch and across episode ends."""
    with closing(subject.make_vec(_NUM_ENVS, AutoresetMode.SAME_STEP)) as env:
        require_ours(env)
        actions = draw_actions(env.action_space, 140, seed=12)
        env.reset(seed=12)
        for action in actions[:23]:
            env.step(action)
        snapshot = deepcopy(inside(env).snapshot())
        task_values = _task_values(env)
        expect_rows(snapshot, _NUM_ENVS, "snapshot")
        expected = _continue(env, actions[23:])
        inside(env).restore(deepcopy(snapshot))
        for name, value in _task_values(env).items():
            expect_same(task_values[name], value, f"{name} of the task, immediately after the batch is restored")
        _expect_same_steps(expected, _continue(env, actions[23:]), "the restored batch")
    with closing(subject.make_vec(_NUM_ENVS, AutoresetMode.SAME_STEP)) as fresh:
        inside(fresh).restore(deepcopy(snapshot))
        _expect_same_steps(expected, _continue(fresh, actions[23:]), "a restored new batch")


def _task_values(env: Any) -> dict[str, Any]:
    task, context = inside(env).task, inside(env).step_context
    return {"reward()": np.array(task.reward(context)), "is_success()": np.array(task.is_success())}


def _continue(env: Any, actions: list[Any]) -> list[Any]:
    return [deepcopy(env.step(action)[:4]) for action in actions]


def _expect_same_steps(expected: list[Any], actual: list[Any], what: str) -> None:
    parts = ("observation", "reward", "terminated", "truncated")
    for k, (a, b) in enumerate(zip(expected, actual, strict=True), start=1):
        for part, x, y in zip(parts, a, b, strict=True):
            expect_same(x, y, f"{what}, step {k}, {part}")
