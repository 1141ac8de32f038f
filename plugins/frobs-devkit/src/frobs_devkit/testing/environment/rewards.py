"""Checks of rewards and success."""

from __future__ import annotations

from contextlib import closing, suppress
from typing import Any

import numpy as np

from frobs_core.errors import ConfigurationError, FrobsError
from frobs_core.interfaces import load_expert
from frobs_devkit.testing.checks import CheckFailure, Inconclusive, NotApplicable, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.subject import (
    EnvUnderTest,
    achieved_goal,
    inside,
    is_ours,
    observes_truly,
    require_ours,
)

_STEPS = 120
_NEAR_STEPS = 5  # number of steps in episodes that start at their goal
_PATHS, _PATH = 8, 25  # number of actions, and number of steps for which each action is held
_TERM = "frobs/reward/"
_EXPERT_EPISODES = 5


def success_in_every_step(subject: EnvUnderTest) -> None:
    """The info of every step contains ``is_success``, which is the float 0.0 or 1.0."""
    with closing(subject.make()) as env:
        ours, steps = is_ours(env), _steps(env)
    told = [info["is_success"] for _, _, info in steps if "is_success" in info]
    if not told and not ours:
        raise NotApplicable("the environment does not report success")
    expect(
        len(told) == len(steps),
        f"the info contains 'is_success' in {len(told)} of {len(steps)} steps; it must contain 'is_success' at every "
        "step.",
    )
    for value in told:
        expect(type(value) is float and value in (0.0, 1.0), f"'is_success' is {value!r}; it must be 0.0 or 1.0.")


def success_comes_and_goes(subject: EnvUnderTest) -> None:
    """Not all steps are successful, reaching the goal is reported as success, and the task's expert succeeds."""
    with closing(subject.make()) as env:
        require_ours(env)
        told = {info.get("is_success") for _, _, info in _steps(env)}
        expect(
            told != {1.0},
            f"all {_STEPS} steps of random episodes are successful, so 'is_success' carries no information.",
        )
        task, (observation, _) = inside(env).task, env.reset(seed=8)
        of_goals = isinstance(observation, dict) and "achieved_goal" in observation
        if 1.0 not in told and "goal" in task.reset_options and observes_truly(env, "achieved_goal", "desired_goal"):
            reached = achieved_goal(env, observation)
            with suppress(FrobsError, ValueError):  # the task may reject the achieved goal as a desired goal
                env.reset(seed=8, options={"goal": reached})
                success = bool(task.is_success()[0])
                expect(
                    success or not of_goals,
                    f"the achieved goal {reached} equals the desired goal, but is_success() returns False.",
                )
                told.add(float(success))
        if 1.0 not in told and task.expert:
            told.add(_success_of_expert(env))
    if 1.0 not in told:
        raise Inconclusive(
            f"no success in {_STEPS} steps of random episodes, so it is unknown whether success is possible"
        )


def _success_of_expert(env: Any) -> float:
    """Return 1.0 if the task's expert succeeds, or 0.0 if the expert does not support the controllers.

    Raises:
        CheckFailure: The expert does not succeed in any of several episodes.
    """
    try:
        expert = load_expert(inside(env))
    except ConfigurationError:
        return 0.0
    assert expert is not None
    for episode in range(_EXPERT_EPISODES):
        env.reset(seed=episode)
        begins, ended = np.ones(1, bool), False
        while not ended:
            *_, terminated, truncated, info = env.step(expert.act(begins)[0])
            begins, ended = np.zeros(1, bool), terminated or truncated
        if info["is_success"]:
            return 1.0
    raise CheckFailure(
        f"the task's expert '{inside(env).task.expert}' does not succeed in any of {_EXPERT_EPISODES} episodes."
    )


def terms_sum_to_reward(subject: EnvUnderTest) -> None:
    """The reward terms of each step add up to the step's reward."""
    with closing(subject.make()) as env:
        require_ours(env)
        steps = _steps(env)
    names = {key for _, _, info in steps for key in info if key.startswith(_TERM)}
    if not names:
        raise NotApplicable("the task has no reward terms")
    for k, (_, reward, info) in enumerate(steps, start=1):
        missing = sorted(names - info.keys())
        expect(not missing, f"step {k}: the info does not contain {missing}, which the info of other steps contains.")
        if "frobs/diverged" not in info:  # if the physics diverged, the reward is 0, regardless of the terms
            total = sum(info[name] for name in sorted(names))
            expect_close(reward, total, 1e-9 * max(1.0, abs(reward)), f"step {k}: the sum of {sorted(names)}")


def compute_reward_equals_step(subject: EnvUnderTest) -> None:
    """``compute_reward`` returns the same reward as ``step`` for the same goals, and accepts batches of goals."""
    with closing(subject.make()) as env:
        steps = _steps(env)
        if not isinstance(steps[0][0], dict) or "desired_goal" not in steps[0][0]:
            raise NotApplicable("not goal-conditioned")
        with suppress(FrobsError, ValueError, TypeError):  # the task may reject the achieved goal as a desired goal
            steps += _steps(env, {"goal": steps[-1][0]["achieved_goal"].astype(np.float64)}, _NEAR_STEPS)
        if not observes_truly(env, "achieved_goal", "desired_goal"):
            raise NotApplicable("the goals are observed with noise or delay, but the reward uses the true goals")
        compute = getattr(env.unwrapped, "compute_reward", None)
        if compute is None:
            raise CheckFailure(
                "a goal-conditioned environment needs compute_reward(achieved_goal, desired_goal, info)."
            )
        achieved = np.stack([observation["achieved_goal"] for observation, _, _ in steps])  # (k, …)
        desired = np.stack([observation["desired_goal"] for observation, _, _ in steps])
        rewards = np.array([reward for _, reward, _ in steps])
        one_by_one = [compute(a, d, info) for a, d, (_, _, info) in zip(achieved, desired, steps, strict=True)]
        expect_close(
            rewards, np.array(one_by_one), 1e-5, "compute_reward for single goals, compared with the rewards of step()"
        )
        together = np.asarray(compute(achieved, desired, [info for _, _, info in steps]))
        expect_close(
            np.array(one_by_one), together, 1e-12, "compute_reward for a batch of goals, compared with single goals"
        )
        there = np.asarray(compute(desired, desired, [{}] * len(desired)))
        expect(
            (there >= rewards - 1e-9).all(),
            "a reached goal has a lower reward than a step of a random episode: compute_reward(desired, desired, "
            "info) < reward.",
        )
        if is_ours(env) and inside(env).task.reward_type == "sparse":
            expect(
                (there == 0.0).all() and np.isin(rewards, (-1.0, 0.0)).all(),
                "a sparse reward must be 0 if the goal is reached and −1 otherwise, as hindsight experience replay "
                "expects.",
            )


def approaching_pays(subject: EnvUnderTest) -> None:
    """A motion earns a higher reward if it leads toward the goal than if it leads away from the goal."""
    subject.require_pause()
    with closing(subject.make()) as env:
        require_ours(env)
        task = inside(env).task
        if "goal" not in task.reset_options:
            raise NotApplicable("goals cannot be set")
        paths = [_path(env, action) for action in draw_actions(env.action_space, _PATHS, seed=5)]
        action, start, end = max(paths, key=lambda path: float(np.linalg.norm(path[2] - path[1])))
        near = _rewards(env, action, end)
        if near is None or not near[1]:
            raise Inconclusive(
                "the task rejects the goal at the end of a motion, or repeating the motion does not reach this goal"
            )
        for share in (1.0, 0.5, 0.25):
            far = _rewards(env, action, start - share * (end - start))
            if far is not None and not far[1]:
                break
        else:
            raise Inconclusive("the task accepts no goal in the direction opposite to the motion")
    steps = min(len(near[0]), len(far[0]))
    totals = sum(near[0][:steps]), sum(far[0][:steps])
    expect(
        totals[0] > totals[1],
        f"moving toward a goal for {steps} steps earns a total reward of {totals[0]:.4g}, but the same motion away "
        f"from a goal earns {totals[1]:.4g}; check the signs of the reward terms.",
    )


def _path(env: Any, action: Any) -> tuple[Any, Any, Any]:
    """Hold an action; return the action and the achieved goals or tool positions before and after the motion."""
    observation, _ = env.reset(seed=5)
    start = achieved_goal(env, observation)
    for _ in range(_PATH):
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            break
    return action, start, achieved_goal(env, observation)


def _rewards(env: Any, action: Any, goal: Any) -> tuple[list[float], bool] | None:
    """Hold an action, and return the rewards and whether the goal was reached, or None if the goal is rejected."""
    if not any(_accepts(env, part) for part in (goal, goal[:2])):  # goals are positions in space or on the floor
        return None
    rewards, reached = [], False
    for _ in range(_PATH):
        _, reward, terminated, truncated, info = env.step(action)
        rewards.append(float(reward))
        reached |= info.get("is_success") == 1.0
        if reached or terminated or truncated:
            break
    return rewards, reached


def _accepts(env: Any, goal: Any) -> bool:
    """Begin an episode with a goal, and return whether the task accepts the goal."""
    try:
        env.reset(seed=5, options={"goal": goal})
    except (FrobsError, ValueError):
        return False
    return True


def _steps(
    env: Any, options: dict[str, Any] | None = None, count: int = _STEPS
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
