"""Environments and wrappers in the manner of old gym; each is one of Gymnasium's too."""

from __future__ import annotations

from typing import Any

import gymnasium

from frobs_rl_compat.manner import Manner, answer_reset, answer_step, forwarded, manner_of
from frobs_rl_compat.old_gym.seeding import np_random


class Env(gymnasium.Env[Any, Any]):
    """Base class of environments whose ``reset`` returns an observation and whose ``step`` four values."""

    frobs_manner = Manner.GYM
    reward_range = (-float("inf"), float("inf"))

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode; returns the observation."""
        raise NotImplementedError

    def step(self, action: Any) -> Any:
        """Act; returns observation, reward, done, info."""
        raise NotImplementedError

    def seed(self, seed: int | None = None) -> list[int]:
        """Seed ``np_random``."""
        generator, used = np_random(seed)
        self.np_random = generator
        return [used]


class Wrapper(gymnasium.Wrapper[Any, Any, Any, Any], Env):
    """Base class of wrappers in the old manner; attributes of what is wrapped can be read through it.

    Args:
        env: An environment of either manner; ``self.env`` answers in the old one.
    """

    frobs_manner = Manner.GYM

    def __init__(self, env: Any) -> None:
        super().__init__(to_gym(env))

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode; returns the observation."""
        return self.env.reset(**kwargs)

    def step(self, action: Any) -> Any:
        """Act; returns observation, reward, done, info."""
        return self.env.step(action)

    def seed(self, seed: int | None = None) -> Any:
        """Seed what is wrapped."""
        return self.env.seed(seed)  # type: ignore[attr-defined]

    def __getattr__(self, name: str) -> Any:
        return forwarded(self, name)


class ObservationWrapper(Wrapper):
    """Base class of wrappers that change observations."""

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode; returns the changed observation."""
        return self.observation(self.env.reset(**kwargs))

    def step(self, action: Any) -> Any:
        """Act; returns changed observation, reward, done, info."""
        observation, *rest = self.env.step(action)
        return (self.observation(observation), *rest)

    def observation(self, observation: Any) -> Any:
        """Return the changed observation."""
        raise NotImplementedError


class RewardWrapper(Wrapper):
    """Base class of wrappers that change rewards."""

    def step(self, action: Any) -> Any:
        """Act; returns observation, changed reward, done, info."""
        observation, reward, *rest = self.env.step(action)
        return (observation, self.reward(reward), *rest)

    def reward(self, reward: Any) -> Any:
        """Return the changed reward."""
        raise NotImplementedError


class ActionWrapper(Wrapper):
    """Base class of wrappers that change actions."""

    def step(self, action: Any) -> Any:
        """Act with the changed action; returns observation, reward, done, info."""
        return self.env.step(self.action(action))

    def action(self, action: Any) -> Any:
        """Return the changed action."""
        raise NotImplementedError

    def reverse_action(self, action: Any) -> Any:
        """Return the action that was changed."""
        raise NotImplementedError


class FourValues(Wrapper):
    """An environment in Gymnasium's manner, for those who speak old gym's.

    Args:
        env: The environment.
    """

    def __init__(self, env: Any) -> None:
        gymnasium.Wrapper.__init__(self, env)
        self._seed: int | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode; returns the observation."""
        seed, self._seed = self._seed if seed is None else seed, None
        return answer_reset(Manner.GYM, self.env.reset(seed=seed, options=options))

    def step(self, action: Any) -> Any:
        """Act; returns observation, reward, done, info."""
        return answer_step(Manner.GYM, self.env.step(action))

    def seed(self, seed: int | None = None) -> list[int]:
        """Seed the next ``reset``."""
        self._seed = seed
        return [] if seed is None else [seed]

    def render(self, mode: str = "human") -> Any:
        """Draw the environment; how was said when it was made, ``make(…, render_mode=…)``."""
        return self.env.render()


def to_gym(env: Any) -> Any:
    """Return an environment that answers in the manner of old gym: the same one, where it does."""
    return env if manner_of(env) is Manner.GYM else FourValues(env)
