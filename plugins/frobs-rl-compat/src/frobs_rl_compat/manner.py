"""The two manners in which environments answer, and the way from each to the other.

Gymnasium's ``reset`` returns an observation and an info, and ``step`` five values; in the manner of old gym it is the
observation alone, and four, ``done`` in the place of ``terminated`` and ``truncated``. Which of them an environment has is
its attribute ``frobs_manner``; what has none is Gymnasium's.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from enum import Enum
from typing import Any

import gymnasium

from frobs_core.errors import ConfigurationError

TRUNCATED = "TimeLimit.truncated"
"""Old gym's word for ``truncated``, in the info of an episode's last step."""


class Manner(Enum):
    """How an environment answers; the value is the name that a package of it imports."""

    GYM = "gym"
    GYMNASIUM = "gymnasium"


def manner_of(env: Any) -> Manner:
    """Return in which manner an environment answers."""
    found = getattr(env, "frobs_manner", Manner.GYMNASIUM)
    return found if isinstance(found, Manner) else Manner.GYMNASIUM


def answer_reset(manner: Manner, answer: tuple[Any, dict[str, Any]]) -> Any:
    """Return what ``reset`` answers in a manner, given Gymnasium's answer."""
    return answer[0] if manner is Manner.GYM else answer


def answer_step(manner: Manner, answer: tuple[Any, Any, bool, bool, dict[str, Any]]) -> Any:
    """Return what ``step`` answers in a manner, given Gymnasium's answer."""
    if manner is Manner.GYMNASIUM:
        return answer
    observation, reward, terminated, truncated, info = answer
    if truncated:
        info = {**info, TRUNCATED: not terminated}
    return observation, reward, bool(terminated or truncated), info


def understand_reset(answer: Any) -> tuple[Any, dict[str, Any]]:
    """Return Gymnasium's answer to ``reset``, given the answer in either manner."""
    if isinstance(answer, tuple) and len(answer) == 2 and isinstance(answer[1], dict):
        return answer
    return answer, {}


def understand_step(env: Any, answer: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
    """Return Gymnasium's answer to ``step``, given the answer in either manner.

    Raises:
        ConfigurationError: It is neither four values nor five.
    """
    if isinstance(answer, tuple) and len(answer) == 5:
        return answer
    if not isinstance(answer, tuple) or len(answer) != 4:
        shown = f"{len(answer)} values" if isinstance(answer, tuple) else type(answer).__name__
        raise ConfigurationError(
            f"{env}: step() returned {shown}; return observation, reward, done, info, or in the manner of Gymnasium "
            "observation, reward, terminated, truncated, info."
        )
    observation, reward, done, info = answer
    truncated = bool(done and info.get(TRUNCATED, False))
    return observation, reward, bool(done) and not truncated, truncated, info


def to_gymnasium(env: Any) -> Any:
    """Return an environment that answers in Gymnasium's manner: the same one, where it does.

    Raises:
        ConfigurationError: It, or one of its spaces, is of a real ``gym``, whose classes are not Gymnasium's.
    """
    spaces = [getattr(env, name, None) for name in ("action_space", "observation_space")]
    if any(_is_of_real_gym(part) for part in (env, *spaces)):
        version = getattr(sys.modules.get("gym"), "__version__", "")
        raise ConfigurationError(
            f"{type(env).__name__} is made with gym {version}, which is installed here and is not Gymnasium: "
            "'pip uninstall gym', and 'import gym' finds the one of frobs-rl-compat; or let the package import gymnasium."
        )
    return FiveValues(env) if manner_of(env) is Manner.GYM else env


class FiveValues(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment in the manner of old gym, for those who speak Gymnasium's.

    Args:
        env: The environment. It may take ``seed`` in ``reset``, have a method ``seed``, or neither.
    """

    frobs_manner = Manner.GYMNASIUM

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; a seed that the environment has no place for is not used."""
        given = {"seed": seed, "options": options}
        keywords = {key: value for key, value in given.items() if value is not None and self._takes(key)}
        if seed is not None and "seed" not in keywords and callable(getattr(self.env, "seed", None)):
            self.env.seed(seed)  # type: ignore[attr-defined]
        return understand_reset(self.env.reset(**keywords))

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Act: five values."""
        return understand_step(self.env, self.env.step(action))

    def __getattr__(self, name: str) -> Any:
        return forwarded(self, name)

    def _takes(self, keyword: str) -> bool:
        """Return whether ``reset`` of the environment, and of all that it wraps, takes a keyword."""
        return all(_accepts(env.reset, keyword) for env in _chain(self.env))


def forwarded(wrapper: Any, name: str) -> Any:
    """Return an attribute of what a wrapper wraps, as wrappers of old gym did: all but private ones.

    Raises:
        AttributeError: There is none.
    """
    if name.startswith("_") or name == "env":
        raise AttributeError(f"'{type(wrapper).__name__}' object has no attribute '{name}'")
    return wrapper.env.get_wrapper_attr(name)


def _is_of_real_gym(part: Any) -> bool:
    """Return whether an environment or a space is of a ``gym`` that is not ours: ours are Gymnasium's."""
    modules = {base.__module__.partition(".")[0] for base in type(part).__mro__}
    return "gym" in modules and not isinstance(part, gymnasium.Env | gymnasium.Space)


def _chain(env: Any) -> Iterator[Any]:
    while True:
        yield env
        if not isinstance(env, gymnasium.Wrapper):
            return
        env = env.env


def _accepts(function: Any, keyword: str) -> bool:
    parameters = inspect.signature(function).parameters.values()
    return any(p.name == keyword or p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters)
