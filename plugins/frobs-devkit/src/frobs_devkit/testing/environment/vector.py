"""Checks that each environment of a batch is bit-identical to a single environment with the same seed."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from functools import lru_cache
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_devkit.testing.checks import Inconclusive, after, expect
from frobs_devkit.testing.compare import expect_same, row
from frobs_devkit.testing.environment.rollout import Transition, advance, draw_actions, expect_same_transition
from frobs_devkit.testing.environment.under_test import EnvUnderTest

NUM_ENVS = 7
STEPS = 300
_SEED = 20


@after("same_seed_repeats")
def same_step_equals_single(subject: EnvUnderTest) -> None:
    """With same-step autoreset, each environment of a batch is identical to a single environment with the same seed."""
    singles = _play_singles(subject)
    with closing(subject.make_vec(NUM_ENVS, AutoresetMode.SAME_STEP)) as env:
        singles.expect_first(env.reset(seed=_SEED)[0])
        for k in range(STEPS):
            observation, reward, terminated, truncated, info = env.step(singles.actions(k, env.action_space))
            batch = getattr(env.unwrapped, "final_observation", None)
            for i, expected in enumerate(singles.at(k)):
                what = f"environment {i} of {NUM_ENVS}, step {k + 1}"
                _expect_masked(info, "final_obs", i, expected.done, what)
                last_info = info["final_info"] if expected.done else info
                last = info["final_obs"][i] if expected.done else row(observation, i)
                if expected.done and batch is not None:
                    expect_same(expected.observation, row(batch, i), f"{what}: final_observation")
                actual = _transition(last, reward, terminated, truncated, last_info, i, row(observation, i))
                expect_same_transition(expected, actual, what)
    singles.expect_ends()


@after("same_seed_repeats", "same_step_equals_single")
def next_step_equals_single(subject: EnvUnderTest) -> None:
    """With next-step autoreset, each environment of a batch is identical to a single environment with the same seed.

    The step that resets an environment ignores its action, and returns reward 0 without termination or truncation.
    """
    singles = _play_singles(subject)
    position = [0] * NUM_ENVS  # index of each environment's current step in its recording
    ended: list[Transition | None] = [None] * NUM_ENVS
    with closing(subject.make_vec(NUM_ENVS, AutoresetMode.NEXT_STEP)) as env:
        singles.expect_first(env.reset(seed=_SEED)[0])
        for k in range(STEPS):
            action = singles.stack([singles.drawn[i][position[i]] for i in range(NUM_ENVS)], env.action_space)
            observation, reward, terminated, truncated, info = env.step(action)
            for i in range(NUM_ENVS):
                what = f"environment {i} of {NUM_ENVS}, step {k + 1}"
                before = ended[i]
                if before is not None:
                    what = f"{what}, in which the environment is reset"
                    expect_same(before.reset_observation, row(observation, i), f"{what}: the observation")
                    outcome = (float(reward[i]), bool(terminated[i]), bool(truncated[i]))
                    expected_outcome = (0.0, False, False)
                    expect(
                        outcome == expected_outcome,
                        f"{what}: reward, terminated and truncated are {outcome}; expected {expected_outcome}.",
                    )
                    ended[i] = None
                    continue
                expected = singles.plays[i][position[i]]
                last = row(observation, i)
                actual = _transition(last, reward, terminated, truncated, info, i, expected.reset_observation)
                expect_same_transition(expected, actual, what)
                ended[i] = expected if expected.done else None
                position[i] += 1
    singles.expect_ends()


@after("same_seed_repeats", "same_step_equals_single")
def disabled_equals_single(subject: EnvUnderTest) -> None:
    """Without autoreset, each environment of a batch is identical to a single environment, even after masked resets."""
    singles = _Singles(subject, reset_after=lambda i: 9 + 4 * i)
    with closing(subject.make_vec(NUM_ENVS, AutoresetMode.DISABLED)) as env:
        singles.expect_first(env.reset(seed=_SEED)[0])
        for k in range(STEPS):
            observation, reward, terminated, truncated, info = env.step(singles.actions(k, env.action_space))
            row_of = singles.at(k)
            mask = np.array([expected.reset_observation is not None for expected in row_of])
            fresh = env.reset(options={"reset_mask": mask.copy()})[0] if mask.any() else observation
            for i, expected in enumerate(row_of):
                what = f"environment {i} of {NUM_ENVS}, step {k + 1}"
                actual = _transition(row(observation, i), reward, terminated, truncated, info, i, row(fresh, i))
                expect_same_transition(expected, actual, what)
                if mask.any() and not mask[i]:
                    what = f"{what}, while other environments are reset: the observation"
                    expect_same(expected.observation, row(fresh, i), what)
    singles.expect_ends()


@after("same_seed_repeats")
def threads_agree(subject: EnvUnderTest) -> None:
    """A batch with one thread and a batch with two threads give bit-identical results."""
    plays = []
    with subject.ours():
        for threads in (1, 2):
            with closing(subject.make_vec(NUM_ENVS, AutoresetMode.SAME_STEP, num_threads=threads)) as env:
                trace: list[Any] = [env.reset(seed=_SEED)[0]]
                for action in draw_actions(env.action_space, 60, seed=9):
                    trace.append(env.step(action)[:4])
                plays.append(trace)
    for k, (one, two) in enumerate(zip(*plays, strict=True)):
        expect_same(one, two, f"step {k} with two threads, compared with one thread")


class _Singles:
    """Recorded episodes of single environments from ``gym.make``, with the same seeds as the batch."""

    def __init__(self, subject: EnvUnderTest, reset_after: Any = None) -> None:
        self.plays: list[list[Transition]] = []
        self.first: list[Any] = []
        self.drawn: list[list[Any]] = []
        for i in range(NUM_ENVS):
            with closing(subject.make()) as env:
                self.drawn.append(draw_actions(env.action_space, STEPS, seed=100 + i))
                self.first.append(row([env.reset(seed=_SEED + i)[0]], 0))
                self.plays.append(self._play(env, self.drawn[i], reset_after(i) if reset_after else STEPS + 1))
        self.ends = any(transition.done for play in self.plays for transition in play)

    @staticmethod
    def _play(env: gym.Env[Any, Any], actions: list[Any], reset_after: int) -> list[Transition]:
        play, length = [], 0
        for action in actions:
            transition = advance(env, action)
            length = 0 if transition.done else length + 1
            if length == reset_after:
                observation = row([env.reset()[0]], 0)
                transition = Transition(**{**vars(transition), "reset_observation": observation})
                length, reset_after = 0, STEPS + 1  # a single reset puts this environment out of phase with others
            play.append(transition)
        return play

    def at(self, k: int) -> list[Transition]:
        return [play[k] for play in self.plays]

    def actions(self, k: int, space: gym.Space[Any]) -> Any:
        return self.stack([drawn[k] for drawn in self.drawn], space)

    @staticmethod
    def stack(actions: list[Any], space: gym.Space[Any]) -> Any:
        return np.stack(actions).astype(space.dtype) if space.dtype is not None else tuple(actions)

    def expect_ends(self) -> None:
        if not self.ends:
            raise Inconclusive(f"no episode ended in {STEPS} steps, so autoreset did not occur")

    def expect_first(self, observation: Any) -> None:
        for i, expected in enumerate(self.first):
            expect_same(expected, row(observation, i), f"environment {i} of {NUM_ENVS}, the first observation")


@lru_cache(maxsize=1)
def _play_singles(subject: EnvUnderTest) -> _Singles:
    """Return the recordings of single environments, cached for two consecutive checks because recording is slow."""
    return _Singles(subject)


def _expect_masked(info: Mapping[str, Any], key: str, i: int, expected: bool, what: str) -> None:
    mask = info.get(f"_{key}")
    there = mask is not None and bool(mask[i])
    expect(there == expected, f"{what}: the info contains {'a' if there else 'no'} '{key}' for this environment, but "
           f"the episode {'ended' if expected else 'did not end'}.")  # fmt: skip


def _transition(
    observation: Any, reward: Any, terminated: Any, truncated: Any, info: Mapping[str, Any], i: int, fresh: Any
) -> Transition:
    numbers = {
        key: float(values[i])
        for key, values in info.items()
        if not key.startswith("_") and f"_{key}" in info and info[f"_{key}"][i] and np.asarray(values).dtype.kind in "fiub"
        and np.asarray(values).ndim == 1
    }  # fmt: skip
    return Transition(observation, float(reward[i]), bool(terminated[i]), bool(truncated[i]), numbers, fresh)
