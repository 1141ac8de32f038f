"""Checks that an environment's behavior is determined by its seed, and that snapshots are complete."""

from __future__ import annotations

from contextlib import closing
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_devkit.testing.checks import after, expect
from frobs_devkit.testing.compare import difference, expect_rows, expect_same, leaves
from frobs_devkit.testing.environment.rollout import draw_actions, expect_same_play, play
from frobs_devkit.testing.environment.under_test import EnvUnderTest, inside, require_ours

_SEEDS = (0, 1, 2, 3, 10, 1234, 2**31)


def same_seed_repeats(subject: EnvUnderTest) -> None:
    """The same seed and actions give bit-identical results over several episodes, even in a second environment."""
    subject.require_pause()
    with closing(subject.make()) as env, closing(subject.make()) as other:
        actions = draw_actions(env.action_space, 130, seed=5)
        expected = play(env, 42, actions)
        expect_same_play(expected, play(other, 42, actions), "episodes with the same seed in a second environment")
        expect_same_play(expected, play(env, 42, actions), "episodes with the same seed in the same environment")


def seeds_differ(subject: EnvUnderTest) -> None:
    """Different seeds give different initial observations."""
    with closing(subject.make()) as env:
        first = {seed: deepcopy(env.reset(seed=seed)[0]) for seed in _SEEDS}
    _expect_distinct(
        first, "seeds {} and {} give the same initial observation; derive the initial state from the seed."
    )


def episodes_differ(subject: EnvUnderTest) -> None:
    """Consecutive episodes have different initial observations, because unseeded resets continue the random stream."""
    with closing(subject.make()) as env:
        first = {0: deepcopy(env.reset(seed=7)[0])}
        for episode in range(1, 5):
            env.step(draw_actions(env.action_space, 1, seed=episode)[0])
            first[episode] = deepcopy(env.reset()[0])
    _expect_distinct(first, "episodes {} and {} after a reset with a seed begin with the same observation.")


@after("same_seed_repeats")
def reset_forgets_history(subject: EnvUnderTest) -> None:
    """After a reset with a seed, an environment behaves like a new environment, regardless of its history."""
    subject.require_pause()
    with closing(subject.make()) as env:
        space = env.action_space
        actions = draw_actions(space, 40, seed=6)
        expected = play(env, 99, actions)
    histories: dict[str, list[Any]] = {
        "a few steps": draw_actions(space, 7, seed=1),
        "several episodes": draw_actions(space, 130, seed=2),
    }
    if isinstance(space, gym.spaces.Box) and space.is_bounded():
        histories["the largest actions"] = [space.high.copy()] * 30
        histories["the smallest actions"] = [space.low.copy()] * 30
    with closing(subject.make()) as env:
        for name, history in histories.items():
            play(env, 1, history)
            expect_same_play(
                expected,
                play(env, 99, actions),
                f"an environment that is reset after {name}, compared with a new environment",
            )


def _expect_distinct(observations: dict[int, Any], message: str) -> None:
    """Raise CheckFailure if any two observations are equal or, for integer observations, if all are equal."""
    items = list(observations.items())
    equal = [(a, b) for i, (a, x) in enumerate(items) for b, y in items[i + 1 :] if difference(x, y) is None]
    few = all(leaf.dtype.kind not in "fc" for leaf in leaves(items[0][1]).values())
    pairs = len(items) * (len(items) - 1) // 2
    expect(len(equal) < pairs if few else not equal, message.format(*np.ravel(equal[:1])) if equal else "")


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
