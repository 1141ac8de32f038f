"""Checks that training does not worsen the policy on a task that every algorithm can learn."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec

from frobs_devkit.testing.algorithm.subject import AlgorithmUnderTest
from frobs_devkit.testing.checks import NotApplicable, expect

_WORSE = 0.2  # tolerated decrease of the mean reward (about −0.5 before training, 0 for the best policy)
_OBSERVATIONS = 256


class Aim(gym.Env[Any, Any]):
    """An environment whose observation directly shows the best action.

    Each observation is a random number in [−1, 1]. The best continuous action equals this number. The best discrete
    action is 1 if the number is positive, and 0 otherwise. The reward is 0 for the best action, and negative otherwise.
    """

    def __init__(self, discrete: bool) -> None:
        self.observation_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.action_space = gym.spaces.Discrete(2) if discrete else gym.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Return the first number."""
        super().reset(seed=seed)
        return self._show(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Return the next number, and the reward of the action that was chosen for the previous number."""
        reward = float(self.rewards(self._shown[None], np.asarray(action)[None])[0])
        return self._show(), reward, False, False, {}

    def rewards(self, shown: Any, actions: Any) -> Any:
        """Return the reward (n,) of each action, given the observed number (n, 1) in the same row."""
        if isinstance(self.action_space, gym.spaces.Discrete):
            return -np.abs(np.asarray(actions).reshape(-1) - (shown[:, 0] > 0.0))
        return -np.abs(np.asarray(actions).reshape(-1) - shown[:, 0])

    def _show(self) -> Any:
        self._shown = self.np_random.uniform(-1.0, 1.0, 1).astype(np.float32)
        return self._shown.copy()


def training_does_not_harm(subject: AlgorithmUnderTest) -> None:
    """If the observation directly shows the best action, training does not make the actions worse."""
    space = subject.untrained.action_space
    if not subject.has_kit_environment:
        raise NotApplicable("this check requires one of the kit's own environments, whose difficulty is known")
    spec = EnvSpec(
        "frobs_kit/Aim-v0",
        f"{__name__}:Aim",
        max_episode_steps=10,
        kwargs={"discrete": not isinstance(space, gym.spaces.Box)},
    )
    aiming = replace(subject, id=spec)
    shown = np.linspace(-1.0, 1.0, _OBSERVATIONS, dtype=np.float32)[:, None]
    with closing(Aim(**spec.kwargs)) as env:
        before, after = (
            float(env.rewards(shown, algorithm.predict(shown)[0]).mean())
            for algorithm in (aiming.untrained, aiming.train(aiming.enough)[0])
        )
    expect(
        after > before - _WORSE,
        f"training for {aiming.enough} steps on a trivial task changes the mean reward per step from "
        f"{before:.2f} to {after:.2f}; check whether a loss is maximized instead of minimized.",
    )
