"""Checks of environments: exceptions, Gymnasium's interface, numbers that are not finite, and endless episodes."""

from __future__ import annotations

import logging
import math
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple, NoReturn

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from frobs_core.description import VECTORS
from frobs_core.sensing.observation import Observations
from frobs_core.util.errors import FrobsError, NonFiniteValueError
from frobs_train.errors import EndlessEpisodeError, EnvironmentFaultError

_log = logging.getLogger("frobs")

TERM_PREFIX = "frobs/reward/"
"""Prefix of the keys of reward terms in ``info``."""

_LIBRARIES = ("gymnasium", "numpy", "frobs_core", "frobs_train")
"""Packages whose code is not the location of a fault if the code of the environment is also on the stack."""


@contextmanager
def fault_named(environment: str, method: str) -> Iterator[None]:
    """Convert an exception of an environment's method to an EnvironmentFaultError that contains the location."""
    try:
        yield
    except (FrobsError, KeyboardInterrupt):
        raise
    except Exception as error:
        text = str(error).strip().partition("\n")[0].rstrip(".")
        raise EnvironmentFaultError(
            environment, f"raised {type(error).__name__} in {method}(){text and f': {text}'}{_location(error)}."
        ) from error


def _location(error: Exception) -> str:
    """Return the last line of the environment's own code that the exception passed through."""
    frames = list(traceback.walk_tb(error.__traceback__))
    own = [
        (frame, line)
        for frame, line in frames
        if frame.f_globals.get("__name__", "").partition(".")[0] not in _LIBRARIES
    ]
    frame, line = (own or frames)[-1]
    return f" ({frame.f_code.co_filename}:{line}, in {frame.f_code.co_name})"


class CheckedEnv(gym.Wrapper[Any, Any, Any, Any]):
    """Wrapper that checks the results of the first reset and the first step against Gymnasium's interface.

    Environments of the same ID can share the set ``warned``, the methods for which a warning has been logged.
    """

    def __init__(self, env: gym.Env[Any, Any], environment: str, warned: set[str] | None = None) -> None:
        super().__init__(env)
        self._id = environment
        self._has_reset = self._has_stepped = False
        self._warned = set() if warned is None else warned

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        returned: tuple[Any, dict[str, Any]] = self.env.reset(seed=seed, options=options)
        if not self._has_reset:
            if not (isinstance(returned, tuple) and len(returned) == 2 and isinstance(returned[1], dict)):
                raise self._fault(
                    f"returns {described(returned)} from reset(), but Gymnasium requires the tuple (observation, info); "
                    "return observation, {} from reset()."
                )
            self._check("reset()", returned[0])
            self._has_reset = True
        return returned

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        returned: tuple[Any, Any, bool, bool, dict[str, Any]] = self.env.step(action)
        if not self._has_stepped:
            if not (isinstance(returned, tuple) and len(returned) == 5 and isinstance(returned[4], dict)):
                raise self._fault(
                    f"returns {described(returned)} from step(), but Gymnasium requires the tuple (observation, reward, "
                    "terminated, truncated, info); for a step() that returns (observation, reward, done, info), insert False "
                    "after done."
                )
            self._check("step()", returned[0])
            if np.shape(returned[1]) != () or np.asarray(returned[1]).dtype.kind not in "fiub":
                raise self._fault(
                    f"returns {described(returned[1])} as reward, but the reward must be a single number; "
                    "return float(reward)."
                )
            self._has_stepped = True
        return returned

    def _check(self, method: str, observation: Any) -> None:
        problem = misfit(self.observation_space, observation)
        if problem is not None:
            raise self._fault(
                f"returns an observation from {method} that does not match its observation_space: {problem}; "
                "change the observation or the observation_space."
            )
        is_array = isinstance(self.observation_space, gym.spaces.Box)
        if not self._warned and not self.observation_space.contains(
            np.asarray(observation) if is_array else observation
        ):
            self._warned.add(method)
            _log.warning(
                "environment '%s' returns an observation from %s that is outside the bounds of its observation_space; "
                "use wider bounds, or clip the observation.",
                self._id,
                method,
            )

    def _fault(self, reason: str) -> EnvironmentFaultError:
        return EnvironmentFaultError(self._id, reason)


class Place(NamedTuple):
    """Location of a number that is not finite in a batch."""

    row: int  # index of the environment
    key: str | None  # key in a dictionary, or None
    element: tuple[int, ...]  # index in the array of the environment
    value: float

    def __str__(self) -> str:
        """Return the location within one environment, such as ``"['camera'][0, 3, 1]"``."""
        key = "" if self.key is None else f"[{self.key!r}]"
        return key + (str(list(self.element)) if self.element else "")


class EpisodeChecks:
    """Checks of the numbers that a vector environment and a policy exchange, and of the length of episodes.

    The methods raise NonFiniteValueError if a number is not finite. After ``longest_episode`` steps, :meth:`count_step`
    raises EndlessEpisodeError. The values of a single environment must be passed with a batch axis. ``lengths``
    (num_envs,) are those of the running episodes, and ``episodes`` (num_envs,) are the numbers of finished ones.
    """

    def __init__(self, env: Any, longest_episode: int | None = None) -> None:
        self._env = env
        self._longest = longest_episode
        self.environment = id_of(env)
        num_envs = getattr(env, "num_envs", 1)
        self.lengths = np.zeros(num_envs, np.int64)
        self.episodes = np.zeros(num_envs, np.int64)

    def check_action(self, actions: Any) -> None:
        """Check actions, (num_envs, …), before the environment takes a step."""
        place = first_not_finite(actions)
        if place is not None:
            raise NonFiniteValueError(
                "the policy",
                f"returned an action that is not finite, because its network diverged: action{place} is {place.value} "
                f"{self._when(place.row, 1)}",
                "train again, for example with a lower learning_rate or with normalized observations and rewards",
            )

    def count_step(self, rewards: Any, info: Mapping[str, Any]) -> None:
        """Count a step and check its rewards, (num_envs,)."""
        self.lengths += 1
        place = first_not_finite(rewards)
        if place is not None:
            terms = [
                name
                for name, values in {**info, **info.get("final_info", {})}.items()
                if name.startswith(TERM_PREFIX) and not np.isfinite(values[place.row])
            ]
            raise self._not_finite(f"the reward is {place.value}", place.row, terms)
        if self._longest is not None and self.lengths.max() >= self._longest:
            raise EndlessEpisodeError(self.environment, self._longest)

    def check_observation(self, observation: Any) -> None:
        """Check observations, (num_envs, …)."""
        place = first_not_finite(observation)
        if place is not None:
            self._reject(place)

    def check_final(self, final: Any, ids: npt.NDArray[np.intp]) -> None:
        """Check the last observations of episodes in the environments with the indices ``ids``, (n,).

        They are an object array (num_envs,), whose elements may differ in type, or a batch (num_envs, …).
        """
        single = isinstance(final, np.ndarray) and final.dtype == object
        for row in ids.tolist() if single else []:
            place = first_not_finite(final[row], batched=False)
            if place is not None:
                self._reject(place._replace(row=row))
        if not single:
            place = first_not_finite(
                {key: part[ids] for key, part in final.items()} if isinstance(final, dict) else final[ids]
            )
            if place is not None:
                self._reject(place._replace(row=int(ids[place.row])))

    def check_metric(self, name: str, values: npt.NDArray[Any], ids: npt.NDArray[np.intp]) -> None:
        """Check a metric, (n,), of episodes that have ended in the environments with the indices ``ids``, (n,)."""
        place = first_not_finite(values)
        if place is not None:
            raise self._not_finite(f"the metric '{name}' is {place.value}", int(ids[place.row]))

    def begin_again(self, done: npt.NDArray[np.bool_]) -> None:
        """Count the episodes that have ended, given as a mask, (num_envs,)."""
        self.lengths[done] = 0
        self.episodes[done] += 1

    def _reject(self, place: Place) -> NoReturn:
        raise self._not_finite(f"observation{place} is {place.value}", place.row, term_at(self._env, place))

    def _not_finite(self, what: str, row: int, terms: Sequence[str] = ()) -> NonFiniteValueError:
        named = f" ({', '.join(terms)})" if terms else ""
        return NonFiniteValueError(
            f"environment '{self.environment}'",
            f"returned a value that is not finite: {what}{named} {self._when(row)}",
            "change the environment so that it returns finite numbers, or ends the episode before",
        )

    def _when(self, row: int, later: int = 0) -> str:
        step = int(self.lengths[row]) + later
        when = f"at step {step:,}" if step else "at the reset"
        return f"in environment {row}, {when} of episode {int(self.episodes[row]) + 1:,}"


def first_not_finite(values: Any, batched: bool = True) -> Place | None:
    """Return the location of the first number that is not finite in an array, dictionary or tuple, or None.

    If the arrays are not batched, they have no axis of environments, and the row of the result is 0.
    """
    if isinstance(values, dict | tuple):
        for key, part in values.items() if isinstance(values, dict) else enumerate(values):
            place = first_not_finite(part, batched)
            if place is not None:
                return place._replace(key=str(key) if place.key is None else f"{key}.{place.key}")
        return None
    array = np.asarray(values)
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return None
    first = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
    row, index = (first[0], first[1:]) if batched else (0, first)
    return Place(row, None, index, float(array[first]))


def term_at(env: Any, place: Place) -> list[str]:
    """Return the name of the observation term of a FRobs environment at a location, if it is known."""
    observations = getattr(env.unwrapped, "observations", None)
    space = getattr(env, "single_observation_space", env.observation_space)
    if not isinstance(observations, Observations) or space != observations.space:
        return []
    return [
        f"term '{name}'"
        for name, (key, columns) in observations.columns.items()
        if key == (place.key or VECTORS)
        and (columns == slice(None) or columns.start <= place.element[0] < columns.stop)
    ]


def misfit(space: gym.Space[Any], value: Any, name: str = "observation") -> str | None:
    """Return why a value is not an element of a space, except for bounds, or None."""
    if isinstance(space, gym.spaces.Dict) and not (isinstance(value, dict) and set(value) == set(space.spaces)):
        actual = f"the keys {', '.join(map(str, value))}" if isinstance(value, dict) else described(value)
        return f"{name} has {actual} instead of the keys {', '.join(map(str, space.spaces))}"
    if isinstance(space, gym.spaces.Tuple) and not (isinstance(value, tuple) and len(value) == len(space.spaces)):
        return f"{name} is {described(value)} instead of a tuple of {len(space.spaces)} elements"
    if isinstance(space, gym.spaces.Dict | gym.spaces.Tuple):
        inside: Any = space.spaces.items() if isinstance(space, gym.spaces.Dict) else enumerate(space.spaces)
        parts = (misfit(inner, value[key], f"{name}[{key!r}]") for key, inner in inside)
        return next(filter(None, parts), None)
    if isinstance(space, gym.spaces.Box):
        if np.shape(value) != space.shape:
            return f"{name} is {described(value)}, but the space has the shape {space.shape}"
        if not np.can_cast(np.asarray(value).dtype, space.dtype, "same_kind"):
            return f"{name} is {described(value)}, but the space has the type {space.dtype}"
        return None
    return None if space.contains(value) else f"{name} is {value!r:.80}, which is not in {space}"


def described(value: Any) -> str:
    """Return the type of a value, including the shape of an array or the length of a tuple, for messages."""
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape} and type {value.dtype}"
    if isinstance(value, tuple):
        return f"a tuple of {len(value)} elements"
    return f"{value!r:.80} of type {type(value).__name__}"


def has_time_limit(env: Any) -> bool:
    """Return whether each episode of an environment ends after a known number of steps."""
    limit = getattr(env.unwrapped, "max_episode_steps", None if env.spec is None else env.spec.max_episode_steps)
    wrapped: Any = getattr(env.unwrapped, "envs", [env])[0]  # a time limit may also be a wrapper of a single one
    while limit is None and isinstance(wrapped, gym.Wrapper):
        limit = wrapped._max_episode_steps if isinstance(wrapped, gym.wrappers.TimeLimit) else None
        wrapped = wrapped.env
    return limit is not None and limit != math.inf


def id_of(env: Any) -> str:
    """Return the Gymnasium ID of an environment, or the name of its class."""
    return str(env.spec.id) if env.spec is not None else type(env.unwrapped).__name__
