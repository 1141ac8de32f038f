"""Environments and wrappers with old gym's API, which are also instances of Gymnasium's classes."""

from __future__ import annotations

from typing import Any

import gymnasium

from frobs_rl_compat.manner import forwarded, has_gym_api, to_four_values
from frobs_rl_compat.old_gym.seeding import np_random


class Env(gymnasium.Env[Any, Any]):
    """Base class of environments whose ``reset`` returns an observation, and whose ``step`` returns four values."""

    has_gym_api = True
    reward_range = (-float("inf"), float("inf"))

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode; return the observation."""
        raise NotImplementedError

    def step(self, action: Any) -> Any:
        """Execute an action; return observation, reward, done, info."""
        raise NotImplementedError

    def seed(self, seed: int | None = None) -> list[int]:
        """Seed ``np_random``."""
        generator, used = np_random(seed)
        self.np_random = generator
        return [used]


class Wrapper(gymnasium.Wrapper[Any, Any, Any, Any], Env):
    """Base class of wrappers with old gym's API; attributes of the wrapped environment are accessible through it.

    Args:
        env: An environment with either API; ``self.env`` has old gym's.
    """

    has_gym_api = True

    def __init__(self, env: Any) -> None:
        super().__init__(to_gym(env))

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode; return the observation."""
        return self.env.reset(**kwargs)

    def step(self, action: Any) -> Any:
        """Execute an action; return observation, reward, done, info."""
        return self.env.step(action)

    def seed(self, seed: int | None = None) -> Any:
        """Seed the wrapped environment."""
        return self.env.seed(seed)  # type: ignore[attr-defined]

    def __getattr__(self, name: str) -> Any:
        return forwarded(self, name)


class ObservationWrapper(Wrapper):
    """Base class of wrappers that change observations."""

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode; return the changed observation."""
        return self.observation(self.env.reset(**kwargs))

    def step(self, action: Any) -> Any:
        """Execute an action; return changed observation, reward, done, info."""
        observation, *rest = self.env.step(action)
        return (self.observation(observation), *rest)

    def observation(self, observation: Any) -> Any:
        """Return the changed observation."""
        raise NotImplementedError


class RewardWrapper(Wrapper):
    """Base class of wrappers that change rewards."""

    def step(self, action: Any) -> Any:
        """Execute an action; return observation, changed reward, done, info."""
        observation, reward, *rest = self.env.step(action)
        return (observation, self.reward(reward), *rest)

    def reward(self, reward: Any) -> Any:
        """Return the changed reward."""
        raise NotImplementedError


class ActionWrapper(Wrapper):
    """Base class of wrappers that change actions."""

    def step(self, action: Any) -> Any:
        """Execute the changed action; return observation, reward, done, info."""
        return self.env.step(self.action(action))

    def action(self, action: Any) -> Any:
        """Return the changed action."""
        raise NotImplementedError

    def reverse_action(self, action: Any) -> Any:
        """Return the original action."""
        raise NotImplementedError


class FourValues(Wrapper):
    """Converts an environment with Gymnasium's API to old gym's."""

    def __init__(self, env: Any) -> None:
        gymnasium.Wrapper.__init__(self, env)
        self._seed: int | None = None

    def reset(self, *, seed: int | None = None, **kwargs: Any) -> Any:
        """Begin an episode; return the observation."""
        seed, self._seed = self._seed if seed is None else seed, None
        return self.env.reset(seed=seed, **kwargs)[0]

    def step(self, action: Any) -> Any:
        """Execute an action; return observation, reward, done, info."""
        return to_four_values(self.env.step(action))

    def seed(self, seed: int | None = None) -> list[int]:
        """Seed the next ``reset``."""
        self._seed = seed
        return [] if seed is None else [seed]

    def render(self, mode: str = "human") -> Any:
        """Render the environment in the mode of ``make(…, render_mode=…)``."""
        return self.env.render()


def to_gym(env: Any) -> Any:
    """Return an environment with old gym's API; unchanged if it already has it."""
    return env if has_gym_api(env) else FourValues(env)
