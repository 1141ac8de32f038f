"""Environment and wrapper classes with the old gym API, which are subclasses of Gymnasium's classes."""

from __future__ import annotations

from typing import Any

import gymnasium

from frobs_rl_compat.gym_api import forwarded, has_gym_api, to_four_values
from frobs_rl_compat.old_gym.seeding import np_random


class Env(gymnasium.Env[Any, Any]):
    """Base class for environments with the old gym API, in which ``step`` returns four values."""

    has_gym_api = True
    reward_range = (-float("inf"), float("inf"))

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode and return the observation."""
        raise NotImplementedError

    def step(self, action: Any) -> Any:
        """Execute an action and return ``(observation, reward, done, info)``."""
        raise NotImplementedError

    def seed(self, seed: int | None = None) -> list[int]:
        """Seed ``np_random``."""
        generator, used = np_random(seed)
        self.np_random = generator
        return [used]


class Wrapper(gymnasium.Wrapper[Any, Any, Any, Any], Env):
    """Base class for wrappers with the old gym API that also expose the wrapped environment's attributes.

    Args:
        env: An environment with the old gym API or the Gymnasium API. ``self.env`` provides this environment through
            the old gym API.
    """

    has_gym_api = True

    def __init__(self, env: Any) -> None:
        super().__init__(to_gym(env))

    def reset(self, **kwargs: Any) -> Any:
        return self.env.reset(**kwargs)

    def step(self, action: Any) -> Any:
        return self.env.step(action)

    def seed(self, seed: int | None = None) -> Any:
        return self.env.seed(seed)  # type: ignore[attr-defined]

    def __getattr__(self, name: str) -> Any:
        return forwarded(self, name)


class ObservationWrapper(Wrapper):
    """Base class for wrappers that modify observations."""

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode and return the modified observation."""
        return self.observation(self.env.reset(**kwargs))

    def step(self, action: Any) -> Any:
        """Execute an action and return ``(observation, reward, done, info)`` with the modified observation."""
        observation, *rest = self.env.step(action)
        return (self.observation(observation), *rest)

    def observation(self, observation: Any) -> Any:
        """Return the modified observation."""
        raise NotImplementedError


class RewardWrapper(Wrapper):
    """Base class for wrappers that modify rewards."""

    def step(self, action: Any) -> Any:
        """Execute an action and return ``(observation, reward, done, info)`` with the modified reward."""
        observation, reward, *rest = self.env.step(action)
        return (observation, self.reward(reward), *rest)

    def reward(self, reward: Any) -> Any:
        """Return the modified reward."""
        raise NotImplementedError


class ActionWrapper(Wrapper):
    """Base class for wrappers that modify actions."""

    def step(self, action: Any) -> Any:
        """Execute the modified action and return ``(observation, reward, done, info)``."""
        return self.env.step(self.action(action))

    def action(self, action: Any) -> Any:
        """Return the modified action."""
        raise NotImplementedError

    def reverse_action(self, action: Any) -> Any:
        """Return the original action for a modified action."""
        raise NotImplementedError


class FourValues(Wrapper):
    """Wrapper that converts an environment with Gymnasium's API to the old gym API."""

    def __init__(self, env: Any) -> None:
        gymnasium.Wrapper.__init__(self, env)
        self._seed: int | None = None

    def reset(self, *, seed: int | None = None, **kwargs: Any) -> Any:
        seed, self._seed = self._seed if seed is None else seed, None
        return self.env.reset(seed=seed, **kwargs)[0]

    def step(self, action: Any) -> Any:
        return to_four_values(self.env.step(action))

    def seed(self, seed: int | None = None) -> list[int]:
        self._seed = seed
        return [] if seed is None else [seed]

    def render(self, mode: str = "human") -> Any:
        """Render the environment in the ``render_mode`` that was passed to ``make``, ignoring ``mode``."""
        return self.env.render()


def to_gym(env: Any) -> Any:
    """Convert an environment to the old gym API, or return it unchanged if it already has this API."""
    return env if has_gym_api(env) else FourValues(env)
