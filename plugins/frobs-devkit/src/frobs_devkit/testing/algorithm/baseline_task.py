"""Checks on tasks that every algorithm can learn: training does not worsen the policy, and the discount counts."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec

from frobs_devkit.testing.algorithm.under_test import DISCOUNT, AlgorithmUnderTest
from frobs_devkit.testing.checks import CheckFailure, Inconclusive, NotApplicable, after, expect

_WORSE = 0.2  # tolerated decrease of the mean reward (about −0.5 before training, 0 for the best policy)
_OBSERVATIONS = 256


class Aim(gym.Env[Any, Any]):
    """An environment whose observation directly shows the best action.

    Each observation is a random number x in [−1, 1]. The best continuous action is 4 + 2 x, in a space that contains
    neither 0 nor any normalized action. The best discrete action is 1 if x is positive, and 0 otherwise. The reward is
    0 for the best action, and negative otherwise. If it ``terminates``, every step terminates its episode.
    """

    def __init__(self, discrete: bool, terminates: bool = False) -> None:
        self._terminates = terminates
        self.observation_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.action_space = gym.spaces.Discrete(2) if discrete else gym.spaces.Box(2.0, 6.0, (1,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        return self._show(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        reward = float(self.rewards(self._shown[None], np.asarray(action)[None])[0])
        return self._show(), reward, self._terminates, False, {}

    def rewards(self, shown: Any, actions: Any) -> Any:
        """Return the reward (n,) of each action, given the observed number (n, 1) in the same row."""
        if isinstance(self.action_space, gym.spaces.Discrete):
            return -np.abs(np.asarray(actions).reshape(-1) - (shown[:, 0] > 0.0))
        return -np.abs((np.asarray(actions, np.float64).reshape(-1) - 4.0) / 2.0 - shown[:, 0])

    def _show(self) -> Any:
        self._shown = self.np_random.uniform(-1.0, 1.0, 1).astype(np.float32)
        return self._shown.copy()


class Choice(gym.Env[Any, Any]):
    """An environment with one choice: a reward of 2.6 at once, or a reward of 1 in each step until the time limit.

    In the first step, the observation is 1, action 0 earns 2.6 and terminates the episode, and action 1 earns 1. In all
    other steps, the observation is −1, and every action earns 1.
    """

    observation_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
    action_space = gym.spaces.Discrete(2)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self._is_first = True
        return np.ones(1, np.float32), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        at_once = self._is_first and int(action) == 0
        self._is_first = False
        return -np.ones(1, np.float32), 2.6 if at_once else 1.0, at_once, False, {}


def choosing(subject: AlgorithmUnderTest, *, time_limit: int) -> AlgorithmUnderTest:
    """Return the algorithm to be trained in :class:`Choice` with a time limit [steps].

    The check does not apply if the user chose the environment, or the algorithm does not support discrete actions.
    """
    _require_kit(subject)
    if "Discrete" not in subject.record.action_spaces:
        raise NotApplicable("the algorithm does not support discrete actions")
    return replace(subject, id=EnvSpec("frobs_kit/Choice-v0", f"{__name__}:Choice", max_episode_steps=time_limit))


def _require_kit(subject: AlgorithmUnderTest) -> None:
    if not subject.has_kit_environment:
        raise NotApplicable("this check requires one of the kit's own environments, whose difficulty is known")


def aiming(subject: AlgorithmUnderTest, *, terminates: bool = False) -> AlgorithmUnderTest:
    """Return the algorithm to be trained in :class:`Aim`, or raise NotApplicable if the user chose the environment."""
    _require_kit(subject)
    discrete = not isinstance(subject.untrained.action_space, gym.spaces.Box)
    spec = EnvSpec(
        "frobs_kit/Aim-v0",
        f"{__name__}:Aim",
        max_episode_steps=10,
        kwargs={"discrete": discrete, "terminates": terminates},
    )
    return replace(subject, id=spec)


def training_does_not_harm(subject: AlgorithmUnderTest) -> None:
    """If the observation directly shows the best action, training does not make the actions worse.

    All actions are inside an action space whose center is not 0.
    """
    aim = aiming(subject)
    shown = np.linspace(-1.0, 1.0, _OBSERVATIONS, dtype=np.float32)[:, None]
    trained, monitor = aim.train(aim.enough)
    predicted = [algorithm.predict(shown)[0] for algorithm in (aim.untrained, trained)]
    with closing(gym.make(aim.id)) as env:
        space, scores = env.action_space, [env.unwrapped.rewards(shown, actions).mean() for actions in predicted]  # type: ignore[attr-defined]
    outside = [
        monitor.env.outside,
        *(a for actions in predicted for a in actions if not space.contains(a.astype(space.dtype))),
    ]
    odd = next((actions for actions in outside if actions is not None), None)
    expect(odd is None, f"an action is outside the action space {space}: {odd}; scale actions with low and high.")
    expect(
        scores[1] > scores[0] - _WORSE,
        f"training for {aim.enough} steps on a trivial task changes the mean reward per step from "
        f"{scores[0]:.2f} to {scores[1]:.2f}; check whether a loss is maximized instead of minimized.",
    )


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
