"""Checks that the discount and the final observations of episodes affect training."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_devkit.testing.algorithm.baseline_task import aiming, choosing
from frobs_devkit.testing.algorithm.under_test import DISCOUNT, AlgorithmUnderTest
from frobs_devkit.testing.checks import CheckFailure, Inconclusive, NotApplicable, after, expect

_OTHER = 0.5  # a discount that no algorithm uses by default
_NONE = 0.01  # a discount with which the future does not count
_EPISODE = 10  # [steps]
_CHOICE = 5  # training steps for a simple choice, as a multiple of those of other checks


class _OtherEnds(gym.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """A vector wrapper that negates the final observations of episodes and counts truncated episodes."""

    ends = 0

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(actions)
        if "final_obs" in info:
            self.ends += int(truncated.sum())
            changed = [None if final is None else -np.asarray(final) for final in info["final_obs"]]
            finals = np.empty(len(changed), object)
            finals[:] = changed
            info = {**info, "final_obs": finals}
        return observation, reward, terminated, truncated, info


@after("same_seed_repeats")
def discount_counts(subject: AlgorithmUnderTest) -> None:
    """Training with a different discount ``gamma`` gives a different result."""
    _require_discount(subject)
    subject.require_reproducible()
    expect(
        subject.different(subject.trained, _with_discount(subject, _OTHER).trained),
        f"training with {DISCOUNT}={_OTHER} gives the same result as with {DISCOUNT}="
        f"{subject.settings[DISCOUNT]}; the setting has no effect.",
    )


@after("same_seed_repeats")
def final_observations_count(subject: AlgorithmUnderTest) -> None:
    """Truncated episodes bootstrap from the final observation, not from the first observation of the next episode.

    With same-step autoreset, ``info["final_obs"]`` contains the final observation, and ``step`` returns the first
    observation of the next episode.
    """
    _require_discount(subject)
    subject.require_reproducible()
    runs = [subject.train(subject.steps, wrap=wrap, max_episode_steps=_EPISODE) for wrap in (None, _OtherEnds)]
    ends = getattr(runs[1][1].env.env, "ends", 0)
    if not ends:
        raise Inconclusive(f"no episode was truncated in {subject.steps} steps")
    expect(
        subject.different(*runs),
        f"{ends} episodes were truncated, but changing their final observations does not affect training; bootstrap "
        "from info['final_obs'], because step() returns the first observation of the next episode.",
    )


@after("discount_counts")
def discount_ends_with_an_episode(subject: AlgorithmUnderTest) -> None:
    """If every step terminates its episode, no step has a future, so the discount has no effect.

    A discount that counts reveals bootstrapping after a termination, or returns that continue in the next episode.
    """
    _require_discount(subject)
    subject.require_reproducible()
    single = aiming(subject, terminates=True)
    runs = [_with_discount(single, discount).trained for discount in (subject.settings[DISCOUNT], _OTHER)]
    text = single.different(*runs)
    expect(
        text is None,
        f"every step terminates its episode, but another {DISCOUNT} changes the training run: {text}. Neither "
        "bootstrap after a terminated step, nor continue returns or advantages across the end of an episode.",
    )


@after("discount_counts")
def rewards_are_discounted_per_step(subject: AlgorithmUnderTest) -> None:
    """A reward that is n steps away counts gamma to the power of n, also if a value is bootstrapped after n steps.

    With a discount of 0.5, a reward of 1 in each step is worth 2, less than a reward of 2.6 at once. A value after n
    steps that counts gamma instead is worth at least 3.
    """
    _require_discount(subject)
    choice = choosing(subject, time_limit=_EPISODE)
    impatient = _with_discount(choice, _NONE)
    first, steps = np.ones((1, 1), np.float32), _CHOICE * subject.steps
    if _with_discount(choice, _OTHER).train(steps)[0].predict(first)[0][0] == 0:
        return
    if impatient.train(steps)[0].predict(first)[0][0] != 0:
        raise Inconclusive(f"training for {steps} steps does not teach the algorithm to choose the larger reward")
    raise CheckFailure(
        f"with {DISCOUNT}={_OTHER}, the algorithm prefers a reward of 1 in each step, which is worth 2, to a reward of 2.6 "
        f"at once; discount a value that is bootstrapped after n steps with {DISCOUNT} to the power of n.",
    )


def _with_discount(subject: AlgorithmUnderTest, discount: float) -> AlgorithmUnderTest:
    return replace(subject, config={**subject.config, DISCOUNT: discount})


def _require_discount(subject: AlgorithmUnderTest) -> None:
    if DISCOUNT not in subject.settings:
        raise NotApplicable(f"the algorithm has no setting '{DISCOUNT}'")
