"""Checks of rewards."""

from __future__ import annotations

from contextlib import closing, suppress
from typing import Any

import numpy as np

from frobs_core.util.errors import FrobsError
from frobs_devkit.testing.checks import CheckFailure, Inconclusive, NotApplicable, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.environment.rollout import PATH, begin_with_goal, longest_path, random_steps
from frobs_devkit.testing.environment.under_test import (
    EnvUnderTest,
    inside,
    is_ours,
    observes_truly,
)

_NEAR_STEPS = 5  # number of steps in episodes that start at their goal
_TERM = "frobs/reward/"


def terms_sum_to_reward(subject: EnvUnderTest) -> None:
    """The reward terms of each step add up to the step's reward."""
    with subject.ours() as env:
        steps = random_steps(env)
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
        steps = random_steps(env)
        if not isinstance(steps[0][0], dict) or "desired_goal" not in steps[0][0]:
            raise NotApplicable("not goal-conditioned")
        with suppress(FrobsError, ValueError, TypeError):  # the task may reject the achieved goal as a desired goal
            steps += random_steps(env, {"goal": steps[-1][0]["achieved_goal"].astype(np.float64)}, _NEAR_STEPS)
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
    with subject.ours() as env:
        task = inside(env).task
        if "goal" not in task.reset_options:
            raise NotApplicable("goals cannot be set")
        action, path = longest_path(env)
        start, end = path[0], path[-1]
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


def _rewards(env: Any, action: Any, goal: Any) -> tuple[list[float], bool] | None:
    """Hold an action, and return the rewards and whether the goal was reached, or None if the goal is rejected."""
    if not begin_with_goal(env, goal):
        return None
    rewards, reached = [], False
    for _ in range(PATH):
        _, reward, terminated, truncated, info = env.step(action)
        rewards.append(float(reward))
        reached |= info.get("is_success") == 1.0
        if reached or terminated or truncated:
            break
    return rewards, reached
