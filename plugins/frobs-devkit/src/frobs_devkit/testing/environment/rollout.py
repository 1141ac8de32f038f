"""Functions that play episodes with random or constant actions, and compare the results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.errors import FrobsError
from frobs_devkit.testing.checks import expect
from frobs_devkit.testing.compare import expect_same
from frobs_devkit.testing.environment.under_test import achieved_goal

RANDOM_STEPS = 120
PATH = 25  # number of steps for which an action is held
_PATHS = 8


@dataclass(frozen=True)
class Transition:
    """Copies of the values returned by a step and, if the step ended the episode, by the reset that follows.

    Infos contain only scalar numbers.
    """

    observation: Any
    reward: float
    terminated: bool
    truncated: bool
    info: Mapping[str, float]
    reset_observation: Any = None
    reset_info: Mapping[str, float] | None = None

    @property
    def done(self) -> bool:
        """Whether the episode ended."""
        return self.terminated or self.truncated


def draw_actions(space: gym.Space[Any], steps: int, seed: int) -> list[Any]:
    """Draw random actions that depend only on the space and the seed."""
    own = deepcopy(space)
    own.seed(seed)
    return [own.sample() for _ in range(steps)]


def numbers(info: Mapping[str, Any]) -> dict[str, float]:
    """Return the scalar entries of an info, as floats."""
    kinds = (bool, int, float, np.number, np.bool_)
    return {key: float(value) for key, value in info.items() if isinstance(value, kinds)}


def advance(env: gym.Env[Any, Any], action: Any) -> Transition:
    """Step the environment once, and reset it if the episode ended."""
    observation, reward, terminated, truncated, info = env.step(action)
    observation, info = deepcopy(observation), numbers(info)
    if not (terminated or truncated):
        return Transition(observation, float(reward), False, False, info)
    reset_observation, reset_info = env.reset()
    return Transition(
        observation,
        float(reward),
        bool(terminated),
        bool(truncated),
        info,
        deepcopy(reset_observation),
        numbers(reset_info),
    )


def play(env: gym.Env[Any, Any], seed: int, actions: Sequence[Any]) -> tuple[Any, list[Transition]]:
    """Reset with a seed, play all actions over one or more episodes, and return the first observation and all steps."""
    first = deepcopy(env.reset(seed=seed)[0])
    return first, [advance(env, action) for action in actions]


def expect_same_play(
    expected: tuple[Any, Sequence[Transition]], actual: tuple[Any, Sequence[Transition]], what: str
) -> None:
    """Raise CheckFailure unless two sequences of recorded steps are bit-identical."""
    expect_same(expected[0], actual[0], f"{what}: the first observation")
    for k, (a, b) in enumerate(zip(expected[1], actual[1], strict=True), start=1):
        expect_same_transition(a, b, f"{what}, step {k}")


def expect_same_transition(a: Transition, b: Transition, what: str) -> None:
    """Raise CheckFailure unless two recorded steps are bit-identical."""
    expect_same(a.observation, b.observation, f"{what}: the observation")
    expect(a.reward == b.reward, f"{what}: the reward is {b.reward!r} instead of {a.reward!r}.")
    ends = ((a.terminated, a.truncated), (b.terminated, b.truncated))
    expect(ends[0] == ends[1], f"{what}: (terminated, truncated) is {ends[1]} instead of {ends[0]}.")
    expect_same(_without_clocks(a.info), _without_clocks(b.info), f"{what}: the info")
    if a.reset_observation is not None:
        expect_same(a.reset_observation, b.reset_observation, f"{what}: the observation of the next reset")


def _without_clocks(info: Mapping[str, Any]) -> dict[str, Any]:
    """Return an info without measured wall-clock times, which are not reproducible."""
    return {key: value for key, value in info.items() if not key.endswith("_time")}


def longest_path(env: Any) -> tuple[Any, list[Any]]:
    """Hold each of several actions; return the action that leads farthest, with the achieved goal after each step."""
    paths = [(action, _path(env, action)) for action in draw_actions(env.action_space, _PATHS, seed=5)]
    return max(paths, key=lambda path: float(np.linalg.norm(path[1][-1] - path[1][0])))


def _path(env: Any, action: Any) -> list[Any]:
    observation, _ = env.reset(seed=5)
    path = [achieved_goal(env, observation)]
    for _ in range(PATH):
        observation, _, terminated, truncated, _ = env.step(action)
        path.append(achieved_goal(env, observation))
        if terminated or truncated:
            break
    return path


def begin_with_goal(env: Any, goal: Any) -> bool:
    """Begin an episode like those of :func:`longest_path` with a goal, and return whether the task accepts the goal."""
    for part in (goal, goal[:2]):  # goals are positions in space or on the floor
        try:
            env.reset(seed=5, options={"goal": part})
        except (FrobsError, ValueError):
            continue
        return True
    return False


def random_steps(
    env: Any, options: dict[str, Any] | None = None, count: int = RANDOM_STEPS
) -> list[tuple[Any, float, dict[str, Any]]]:
    """Play random episodes, and return (observation, reward, info) for each step."""
    env.reset(seed=8, options=options)
    steps = []
    for action in draw_actions(env.action_space, count, seed=8):
        observation, reward, terminated, truncated, info = env.step(action)
        steps.append((observation, float(reward), dict(info)))
        if terminated or truncated:
            env.reset()
    return steps
