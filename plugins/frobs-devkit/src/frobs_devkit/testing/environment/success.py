"""Checks of success."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import closing, suppress
from copy import deepcopy
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core import load_policy
from frobs_core.contracts import Policy
from frobs_core.plugins import registry
from frobs_core.util.errors import ConfigurationError, FrobsError
from frobs_devkit.testing.checks import CheckFailure, Inconclusive, NotApplicable, after, expect
from frobs_devkit.testing.compare import batch_of_one
from frobs_devkit.testing.environment.rollout import (
    PATH,
    RANDOM_STEPS,
    begin_with_goal,
    draw_actions,
    longest_path,
    random_steps,
)
from frobs_devkit.testing.environment.under_test import (
    EnvUnderTest,
    achieved_goal,
    inside,
    is_ours,
    observes_truly,
)

_EXPERT_EPISODES = 5


def success_in_every_step(subject: EnvUnderTest) -> None:
    """The info of every step contains ``is_success``, which is the float 0.0 or 1.0."""
    with closing(subject.make()) as env:
        ours, steps = is_ours(env), random_steps(env)
    reported = [info["is_success"] for _, _, info in steps if "is_success" in info]
    if not reported and not ours:
        raise NotApplicable("the environment does not report success")
    expect(
        len(reported) == len(steps),
        f"the info contains 'is_success' in {len(reported)} of {len(steps)} steps; it must contain 'is_success' at every "
        "step.",
    )
    for value in reported:
        expect(type(value) is float and value in (0.0, 1.0), f"'is_success' is {value!r}; it must be 0.0 or 1.0.")


def success_comes_and_goes(subject: EnvUnderTest) -> None:
    """Not all steps are successful, reaching the goal is reported as success, and the task's expert succeeds."""
    with subject.ours() as env:
        values = {info.get("is_success") for _, _, info in random_steps(env)}
        expect(
            values != {1.0},
            f"all {RANDOM_STEPS} steps of random episodes are successful, so 'is_success' carries no information.",
        )
        task, (observation, _) = inside(env).task, env.reset(seed=8)
        of_goals = isinstance(observation, dict) and "achieved_goal" in observation
        if 1.0 not in values and "goal" in task.reset_options and observes_truly(env, "achieved_goal", "desired_goal"):
            reached = achieved_goal(env, observation)
            with suppress(FrobsError, ValueError):  # the task may reject the achieved goal as a desired goal
                env.reset(seed=8, options={"goal": reached})
                success = bool(task.is_success()[0])
                expect(
                    success or not of_goals,
                    f"the achieved goal {reached} equals the desired goal, but is_success() returns False.",
                )
                values.add(float(success))
        if 1.0 not in values and task.expert:
            values.add(_success_of_expert(_Seeing(env)))
    if 1.0 not in values:
        raise Inconclusive(
            f"no success in {RANDOM_STEPS} steps of random episodes, so it is unknown whether success is possible"
        )


@after("success_in_every_step", "snapshot_continues")
def success_belongs_to_its_step(subject: EnvUnderTest) -> None:
    """Success describes the state at the end of the step, and sparse rewards are higher in successful steps."""
    subject.require_pause()
    with subject.ours() as env:
        sparse = "sparse" in inside(env).task.reward_types
    rewards: dict[bool, list[float]] = {True: [], False: []}
    ended_in_success = False
    flips: dict[bool, list[_Step]] = {True: [], False: []}  # last steps before success begins (False) or ends (True)
    with closing(subject.make(reward_type="sparse") if sparse else subject.make()) as env:
        for episode in _visits(env):
            for step in episode:
                rewards[step.success].append(step.reward)
            for step, following in pairwise(episode):
                if following.success != step.success:
                    flips[step.success].append(step)
            expect(
                not (episode[-1].terminated and episode[-1].is_late),
                "is_success() changes one step late: when the episode was terminated, it returned False, but it returns "
                "True if advance() is called again in the same state.",
            )
            ended_in_success |= episode[-1].terminated and episode[-1].success
            if all(flips.values()):
                break
    if sparse and all(rewards.values()):
        won, lost = np.mean(rewards[True]), np.mean(rewards[False])
        expect(
            won > lost,
            f"the sparse reward is {won:.4g} on average in successful steps, but {lost:.4g} in other steps; it must be "
            "higher in successful steps.",
        )
    if not all(flips.values()) and not ended_in_success:
        raise Inconclusive("no episode reached success and left it again")
    expect(
        ended_in_success or not all(step.is_late for steps in flips.values() for step in steps),
        "is_success() changes one step late: it returns another value if advance() is called again in the same state.",
    )


def expert_passes_the_checks_of_policies(subject: EnvUnderTest) -> None:
    """The task's expert passes the checks of policies."""
    from frobs_devkit.testing.policy import check_policy  # it uses this package

    subject.require_pause()
    task, _ = registry.environments().get(subject.bare_id, (None, None))
    if task is None or not task.load().expert:
        raise NotApplicable("the task has no expert")
    for check in check_policy("expert", subject.id, **subject.kwargs):
        try:
            check.run()
        except ConfigurationError as error:
            raise NotApplicable(f"the expert cannot act in this environment: {error}") from error


@dataclass(frozen=True)
class _Step:
    """The outcome of a step."""

    success: bool  # what the step reported
    is_late: bool  # whether the task finds another success when it measures the same state again
    reward: float  # the step's reward
    terminated: bool  # whether the step terminated the episode


def _visits(env: Any) -> Iterator[list[_Step]]:
    """Yield the steps of episodes that are likely to reach success and to leave it: to a goal, an expert's, random."""
    task = inside(env).task
    if "goal" in task.reset_options:
        action, path = longest_path(env)
        if begin_with_goal(env, path[len(path) // 2]):
            yield _watch(env, [action] * PATH)
    if task.expert:
        with suppress(ConfigurationError):  # the expert does not support the controllers
            seeing = _Seeing(env)
            yield _watch(seeing, _expert_actions(seeing))
    env.reset(seed=8)
    yield _watch(env, draw_actions(env.action_space, RANDOM_STEPS, seed=8))


def _watch(env: Any, actions: Iterable[Any]) -> list[_Step]:
    steps, task = [], inside(env).task
    for action in actions:
        _, reward, terminated, truncated, info = env.step(action)
        success = bool(task.is_success()[0])
        expect(
            bool(info["is_success"]) == success,
            f"the info has 'is_success' {info['is_success']}, but the task's is_success() returns {success}.",
        )
        steps.append(_Step(success, _measured_again(inside(env)) != success, float(reward), bool(terminated)))
        if terminated or truncated:
            break
    return steps


def _measured_again(env: Any) -> bool:
    """Return the success that a task finds when it measures the current state again."""
    task, state = env.task, deepcopy(env.task.snapshot())
    task.advance(env.step_context)
    task.reward(env.step_context)
    task.is_terminated()
    success = bool(task.is_success()[0])
    task.restore(state)
    return success


def _expert_actions(env: _Seeing) -> Iterator[Any]:
    """Begin an episode, and yield the actions of the task's expert up to the first success, and then random actions."""
    expert = load_policy("expert", env)
    env.reset(seed=0)
    for action in _act(expert, env):
        if inside(env).task.is_success()[0]:
            break
        yield action
    yield from draw_actions(env.action_space, RANDOM_STEPS, seed=0)


class _Seeing(gym.Wrapper[Any, Any, Any, Any]):
    """Keeps the latest observation as a batch of one, because others step the environment while an expert acts."""

    def reset(self, **keywords: Any) -> Any:
        return self._seen(super().reset(**keywords))

    def step(self, action: Any) -> Any:
        return self._seen(super().step(action))

    def _seen(self, result: Any) -> Any:
        self.observation = batch_of_one(result[0])
        return result


def _act(expert: Policy, env: _Seeing) -> Iterator[Any]:
    """Yield the actions of an expert from the start of an episode on."""
    begins = np.ones(1, bool)
    while True:
        yield expert.act(env.observation, begins)[0]
        begins = np.zeros(1, bool)


def _success_of_expert(env: _Seeing) -> float:
    """Return 1.0 if the expert succeeds in one of several episodes, or 0.0 if it does not support the controllers."""
    try:
        expert = load_policy("expert", env)
    except ConfigurationError:
        return 0.0
    for episode in range(_EXPERT_EPISODES):
        env.reset(seed=episode)
        for action in _act(expert, env):
            *_, terminated, truncated, info = env.step(action)
            if terminated or truncated:
                break
        if info["is_success"]:
            return 1.0
    raise CheckFailure(
        f"the task's expert '{inside(env).task.expert}' does not succeed in any of {_EXPERT_EPISODES} episodes."
    )
