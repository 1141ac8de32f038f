"""Registration of IDs: ``gym.register`` adds them to Gymnasium's registry, where both libraries find them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec, load_env_creator

from frobs_rl_compat.manner import to_gymnasium
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
    """Register an environment, which has four values in ``gym.make`` and five in ``gymnasium.make``.

    Args:
        id: ``"KobukiMazeEnv-v0"``
        entry_point: The class, or ``"module:Class"``.
        reward_threshold: Reward at which the environment counts as solved.
        nondeterministic: Whether it is nondeterministic even with a seed.
        max_episode_steps: Steps per episode.
        order_enforce: Whether a step before the first reset is an error.
        kwargs: Keywords for the class.
        **unused: Parameters of later versions of gym.
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
    """Return a new environment of a class with either API, converted to Gymnasium's."""
    creator = load_env_creator(old_entry_point) if isinstance(old_entry_point, str) else old_entry_point
    return to_gymnasium(creator(**kwargs))


def is_made_by_gymnasium(env: gymnasium.Env[Any, Any]) -> bool:
    """Return whether ``gymnasium.make`` created an environment from an ID that Gymnasium itself registered."""
    return env.spec is not None and env.spec.entry_point != _MAKE


def make(id: str | EnvSpec, **kwargs: Any) -> Any:
    """Return a new environment with old gym's API."""
    return to_gym(gymnasium.make(id, **kwargs))


def spec(id: str) -> EnvSpec:
    """Return the registration of an ID."""
    return gymnasium.spec(id)


class EnvRegistry:
    """Gymnasium's registry under old gym's names."""

    @property
    def env_specs(self) -> dict[str, EnvSpec]:
        """The registry, by ID."""
        return gymnasium.registry

    def all(self) -> list[EnvSpec]:
        """Return all registrations."""
        return list(gymnasium.registry.values())

    def spec(self, id: str) -> EnvSpec:
        """Return the registration of an ID."""
        return gymnasium.spec(id)

    def __contains__(self, id: object) -> bool:
        return id in gymnasium.registry

    def __iter__(self) -> Iterator[str]:
        return iter(gymnasium.registry)

    def __getitem__(self, id: str) -> EnvSpec:
        return gymnasium.registry[id]


registry = EnvRegistry()
