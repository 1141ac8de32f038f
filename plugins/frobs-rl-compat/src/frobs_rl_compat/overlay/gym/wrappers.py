"""Gymnasium's wrappers under the same names, but with the old gym API."""

from collections.abc import Callable
from functools import partial
from typing import Any


def __getattr__(name: str) -> Callable[..., Any]:
    import gymnasium.wrappers

    if name.startswith("_") or not hasattr(gymnasium.wrappers, name):
        raise AttributeError(f"neither the 'gym' module of 'frobs legacy run' nor Gymnasium has a wrapper '{name}'.")
    return partial(_wrap, getattr(gymnasium.wrappers, name))


def _wrap(wrapper: Callable[..., Any], env: Any, *args: Any, **kwargs: Any) -> Any:
    from frobs_rl_compat.gym_api import to_gymnasium
    from frobs_rl_compat.old_gym.core import to_gym

    return to_gym(wrapper(to_gymnasium(env), *args, **kwargs))
