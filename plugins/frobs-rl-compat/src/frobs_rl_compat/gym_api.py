"""Conversion between the two environment APIs: the old gym API and the Gymnasium API.

In Gymnasium's API, ``reset`` returns the observation and ``info``, and ``step`` returns five values. In the old gym
API, ``reset`` returns only the observation, and ``step`` returns four values, with ``done`` instead of ``terminated``
and ``truncated``. An environment has the old gym API if its attribute ``has_gym_api`` is True.
"""

from __future__ import annotations

import inspect
import sys
from typing import Any

import gymnasium

from frobs_core.util.errors import ConfigurationError

TRUNCATED = "TimeLimit.truncated"
"""Key in old gym's ``info`` that indicates whether an episode was truncated."""


def has_gym_api(env: Any) -> bool:
    """Return whether an environment has the old gym API, in which ``step`` returns four values."""
    return getattr(env, "has_gym_api", False) is True


def to_four_values(answer: tuple[Any, Any, bool, bool, dict[str, Any]]) -> tuple[Any, Any, bool, dict[str, Any]]:
    """Convert the five values of Gymnasium's ``step`` to the four values of the old gym API."""
    observation, reward, terminated, truncated, info = answer
    if truncated:
        info = {**info, TRUNCATED: not terminated}
    return observation, reward, bool(terminated or truncated), info


def understand_reset(answer: Any) -> tuple[Any, dict[str, Any]]:
    """Convert the return value of ``reset`` in the old gym API or the Gymnasium API to ``(observation, info)``."""
    if isinstance(answer, tuple) and len(answer) == 2 and isinstance(answer[1], dict):
        return answer
    return answer, {}


def understand_step(env: Any, answer: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
    """Convert the return value of ``step`` in the old gym API or the Gymnasium API to Gymnasium's five values."""
    if isinstance(answer, tuple) and len(answer) == 5:
        return answer
    if not isinstance(answer, tuple) or len(answer) != 4:
        shown = f"{len(answer)} values" if isinstance(answer, tuple) else type(answer).__name__
        raise ConfigurationError(
            f"{env}: step() returned {shown}; it must return (observation, reward, done, info) or, as in "
            "Gymnasium, (observation, reward, terminated, truncated, info)."
        )
    observation, reward, done, info = answer
    truncated = bool(done and info.get(TRUNCATED, False))
    return observation, reward, bool(done) and not truncated, truncated, info


def to_gymnasium(env: Any) -> Any:
    """Convert an environment to Gymnasium's API, or return it unchanged if it already has this API.

    Raises:
        ConfigurationError: The environment or one of its spaces is based on the original ``gym``, which is not
            compatible with Gymnasium.
    """
    spaces = [getattr(env, name, None) for name in ("action_space", "observation_space")]
    if any(_is_of_real_gym(part) for part in (env, *spaces)):
        version = getattr(sys.modules.get("gym"), "__version__", "")
        raise ConfigurationError(
            f"{type(env).__name__} uses gym {version}, which is not compatible with Gymnasium. Start the script with "
            "'frobs legacy run', which replaces gym, or change the package to import gymnasium."
        )
    return FiveValues(env) if has_gym_api(env) else env


class FiveValues(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Wrapper that converts an environment with the old gym API to Gymnasium's API.

    Args:
        env: The environment to wrap, which may accept a seed in ``reset``, have a ``seed`` method, or not support
            seeding.
    """

    has_gym_api = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode. The seed is ignored if the environment does not support seeding."""
        given: dict[str, Any] = {"seed": seed, "options": options}
        keywords = {key: value for key, value in given.items() if value is not None and _takes(self.env, key)}
        if seed is not None and "seed" not in keywords and callable(getattr(self.env, "seed", None)):
            self.env.seed(seed)  # type: ignore[attr-defined]
        return understand_reset(self.env.reset(**keywords))

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Execute an action and return Gymnasium's five values."""
        return understand_step(self.env, self.env.step(action))

    def __getattr__(self, name: str) -> Any:
        return forwarded(self, name)


class KeepsApi:
    """Mixin for FRobs_RL's wrappers, which support the old gym API and keep the API of the wrapped environment.

    Args:
        env: The environment to wrap, whose attributes are accessible through the wrapper.
    """

    def __init__(self, env: Any, *args: Any, **kwargs: Any) -> None:
        self.has_gym_api = has_gym_api(env)
        super().__init__(to_gymnasium(env), *args, **kwargs)  # type: ignore[call-arg]

    def reset(self, **kwargs: Any) -> Any:
        """Begin an episode."""
        observation, info = super().reset(**kwargs)  # type: ignore[misc]
        return observation if self.has_gym_api else (observation, info)

    def step(self, action: Any) -> Any:
        """Execute an action."""
        answer = super().step(action)  # type: ignore[misc]
        return to_four_values(answer) if self.has_gym_api else answer

    def __getattr__(self, name: str) -> Any:
        return forwarded(self, name)


def forwarded(wrapper: Any, name: str) -> Any:
    """Return a public attribute of the wrapped environment, as old gym's wrappers did."""
    if name.startswith("_") or name == "env":
        raise AttributeError(f"'{type(wrapper).__name__}' object has no attribute '{name}'")
    return wrapper.env.get_wrapper_attr(name)


def _is_of_real_gym(part: Any) -> bool:
    """Return whether an environment or a space is based on the original ``gym`` instead of FRobs's overlay."""
    modules = {base.__module__.partition(".")[0] for base in type(part).__mro__}
    return "gym" in modules and not isinstance(part, gymnasium.Env | gymnasium.Space)


def _takes(env: Any, keyword: str) -> bool:
    """Return whether ``reset`` accepts a keyword, both in an environment and in all environments that it wraps."""
    parameters = inspect.signature(env.reset).parameters.values()
    accepted = any(p.name == keyword or p.kind is p.VAR_KEYWORD for p in parameters)
    return accepted and (not isinstance(env, gymnasium.Wrapper) or _takes(env.env, keyword))
