"""Registration of environment IDs in Gymnasium's registry, which ``gym.make`` and ``gymnasium.make`` share."""

from __future__ import annotations

from collections import UserDict
from collections.abc import Callable
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec, load_env_creator

from frobs_rl_compat.gym_api import to_gymnasium
from frobs_rl_compat.old_gym.core import to_gym

_MAKE = f"{__name__}:make_for_gymnasium"


def register(
    id: str,
    entry_point: Callable[..., Any] | str | None = None,
    reward_threshold: float | None = None,
    nondeterministic: bool = False,
    max_episode_steps: int | None = None,
    order_enforce: bool = True,
    kwargs: dict[str, Any] | None = None,
    **unused: Any,
) -> None:
    """Register an environment for ``gym.make`` (the old gym API) and ``gymnasium.make`` (the Gymnasium API).

    Args:
        id: ID of the environment, such as ``"KobukiMazeEnv-v0"``.
        entry_point: The class, or ``"module:Class"``.
        reward_threshold: Reward at which the environment is considered solved.
        nondeterministic: Whether the environment is nondeterministic even with a seed.
        max_episode_steps: Maximum number of steps per episode.
        order_enforce: Whether calling ``step`` before the first ``reset`` raises an error.
        kwargs: Keyword arguments for the class.
        **unused: Parameters of later gym versions, which are ignored.
    """
    given = {**(kwargs or {}), "old_entry_point": entry_point}
    known = gymnasium.registry.get(id)
    same = {"entry_point": _MAKE, "kwargs": given, "max_episode_steps": max_episode_steps}
    if known is not None and all(getattr(known, key) == value for key, value in same.items()):
        return
    gymnasium.register(
        id,
        _MAKE,
        reward_threshold=reward_threshold,
        nondeterministic=nondeterministic,
        max_episode_steps=max_episode_steps,
        order_enforce=order_enforce,
        disable_env_checker=True,  # old gym had no checker
        kwargs=given,
    )


def make_for_gymnasium(*, old_entry_point: Callable[..., Any] | str, **kwargs: Any) -> Any:
    """Create an environment, and convert it to Gymnasium's API if necessary."""
    creator = load_env_creator(old_entry_point) if isinstance(old_entry_point, str) else old_entry_point
    return to_gymnasium(creator(**kwargs))


def is_made_by_gymnasium(env: gymnasium.Env[Any, Any]) -> bool:
    """Return whether an environment was created by ``gymnasium.make`` and registered with ``gymnasium.register``."""
    return env.spec is not None and env.spec.entry_point != _MAKE


def make(id: str | EnvSpec, **kwargs: Any) -> Any:
    """Create an environment with the old gym API."""
    return to_gym(gymnasium.make(id, **kwargs))


def spec(id: str) -> EnvSpec:
    """Return the specification registered for an ID."""
    return gymnasium.spec(id)


class EnvRegistry(UserDict[str, EnvSpec]):
    """Gymnasium's registry with the interface of the old gym registry."""

    def __init__(self) -> None:
        self.data = gymnasium.registry

    @property
    def env_specs(self) -> dict[str, EnvSpec]:
        """Specifications of all registered environments, by ID."""
        return self.data

    def all(self) -> list[EnvSpec]:
        """Return the specifications of all registered environments."""
        return list(self.values())

    def spec(self, id: str) -> EnvSpec:
        """Return the specification registered for an ID."""
        return gymnasium.spec(id)


registry = EnvRegistry()
