"""Demonstrations: transitions from a data set, or from episodes that a policy plays."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, fields, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from frobs_algos.spaces import picture_bytes
from frobs_core import load_policy
from frobs_core.contracts import Policy
from frobs_core.description import Observation
from frobs_core.kernel.policies import is_path
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import ConfigurationError, MissingDependencyError, NonFiniteValueError
from frobs_core.util.memory import require_memory

__all__ = ["Demonstrations", "clipped", "collect", "load", "take"]

Array = np.ndarray[Any, Any]

_MOST_ENVS = 64
"""Maximum number of environments in which a policy plays."""

_LONGEST_EPISODE = 20_000
"""Maximum number of steps of an episode without a known time limit. An endless episode would fill the memory."""


@dataclass(frozen=True, kw_only=True)
class Demonstrations:
    """Transitions of n steps. The steps of an episode follow one another.

    Attributes:
        observation: Observations before the actions, as an array (n, …) or a dictionary of such arrays.
        action: Actions as the environment received them, (n, …).
        reward: Rewards of the environment, (n,).
        next_observation: Observations after the actions, in the form of ``observation``, or None if nobody needs them.
        terminated: Whether the episode ended in a terminal state, (n,) bool.
        episode_start: Whether a step is the first step of its episode, (n,) bool.
        intervention: Whether the action is that of the demonstrator, (n,) bool. False for the steps of a policy in whose
            place a person acted in other steps.
        complete: Whether ``next_observation`` is known, (n,) bool. A data set does not contain the observation after the
            last step of an episode.
    """

    observation: Observation
    action: Array
    reward: Array
    next_observation: Observation | None
    terminated: Mask
    episode_start: Mask
    intervention: Mask
    complete: Mask

    def transitions(self) -> Demonstrations:
        """Return the steps whose next observation is known, or not needed because the episode ended there.

        Raises:
            ConfigurationError: There are no such steps.
        """
        rows = np.flatnonzero(self.complete | self.terminated)
        if not len(rows):
            raise ConfigurationError("the demonstrations contain no pairs of steps; record episodes of several steps.")
        return Demonstrations(**{name: take(value, rows) for name, value in vars(self).items()})

    @property
    def episode_end(self) -> Mask:
        """Whether a step is the last step of its episode, (n,) bool."""
        return np.append(self.episode_start[1:], True)


def load(
    source: str,
    env: gym.vector.VectorEnv[Any, Any, Any],
    episodes: int,
    seed: int,
    mapping: str | None = None,
    *,
    following: bool = True,
) -> Demonstrations:
    """Read a data set, or play episodes with a policy.

    Args:
        source: Folder of a data set, or name or path of a policy.
        env: The environments of the training run.
        episodes: Number of episodes that the policy plays. A data set is used as a whole.
        seed: Seed of the episodes that the policy plays.
        mapping: YAML file that maps observation terms to the columns of a data set of others.
        following: Whether to return the observations after the actions, too.

    Raises:
        ConfigurationError: The source does not exist, the environments cannot be recreated, or the observations do not
            fit into memory.
        NonFiniteValueError: A number is not finite.
        FrobsError: The data set cannot be read, or the policy cannot act in the environment.
    """
    path = Path(source)
    if is_path(source) and not path.exists():
        raise ConfigurationError(f"demonstrations: {source} does not exist; write a data set's folder or a policy.")
    if is_path(source) and path.is_dir() and not (path / "config.yaml").is_file():  # a run folder contains a policy
        _check_wrappers(getattr(env, "recipe", None), source)
        found = _read(path, env, mapping, following)
        _require_finite(found, f"demonstrations: {source}", "record it again")
        return found
    if mapping is not None:
        raise ConfigurationError(f"demonstration_mapping: '{source}' is a policy, not a data set; omit the mapping.")
    return collect(env, source, episodes, seed, following=following)


def _check_wrappers(recipe: Any, owner: str) -> None:
    """Check that no wrapper of the training run has statistics that would differ for the demonstrations."""
    for component in getattr(recipe, "wrappers", ()):
        if component.adapts:
            raise ConfigurationError(
                f"{owner} cannot demonstrate with the wrapper {component.name}, whose statistics would differ from those "
                "of the training run; use the algorithm's settings normalize_observation and normalize_reward instead."
            )


def _require_finite(found: Demonstrations, owner: str, remedy: str) -> None:
    for field in fields(found):
        value = getattr(found, field.name)
        for array in value.values() if isinstance(value, dict) else [value]:
            if np.asarray(array).dtype.kind == "f" and not np.isfinite(array).all():
                raise NonFiniteValueError(owner, f"contains a {field.name} that is not finite", remedy)


def collect(
    env: gym.vector.VectorEnv[Any, Any, Any],
    policy_name: str,
    episodes: int,
    seed: int,
    noise: float = 0.0,
    *,
    following: bool = True,
) -> Demonstrations:
    """Play episodes with a policy, in new environments that equal those of the training run.

    Args:
        env: The environments of the training run. Their state and random numbers do not change.
        policy_name: Name or path of the policy.
        episodes: Number of episodes.
        seed: Seed of the episodes.
        noise: Standard deviation of the noise that disturbs continuous actions. The returned actions do not include it,
            so they are the policy's corrections (DART, Laskey et al. 2017).
        following: Whether to return the observations after the actions, too.

    Raises:
        ConfigurationError: The environments cannot be recreated, the pictures do not fit into memory, or an episode
            does not end.
        NonFiniteValueError: A number is not finite.
        FrobsError: The policy does not exist or cannot act in the environment.
    """
    recipe = getattr(env, "recipe", None)
    if recipe is None:
        raise ConfigurationError(f"policy '{policy_name}' can play only in a training run; use frobs_train.train.")
    _check_wrappers(recipe, f"policy '{policy_name}'")
    # With staggered starts, the first episodes would be cut off.
    recipe = replace(recipe, kwargs={key: value for key, value in recipe.kwargs.items() if key != "stagger"})
    playing = recipe.make(min(episodes, _MOST_ENVS), recipe.kwargs.get("num_threads") or 1)
    try:
        with closing(load_policy(policy_name, playing)) as policy:
            _require_memory(playing, policy_name, episodes)
            found = _play(playing, policy, episodes, seed, noise, following)
    finally:
        playing.close()
    _require_finite(found, f"the episodes of policy '{policy_name}'", "change the environment or the policy")
    return found


def _require_memory(env: Any, policy_name: str, episodes: int) -> None:
    """Check that the pictures of the longest possible episodes fit into memory."""
    longest = getattr(env.unwrapped, "max_episode_steps", np.inf)
    size = picture_bytes(env.single_observation_space)
    if size and np.isfinite(longest):
        advice = "let it play at most {count} (demonstration_episodes)"
        require_memory(f"policy '{policy_name}'", size * int(longest), episodes, "episodes", advice)


def _play(
    env: gym.vector.VectorEnv[Any, Any, Any], policy: Policy, episodes: int, seed: int, noise: float, following: bool
) -> Demonstrations:
    num_envs, space, generator = env.num_envs, env.single_action_space, np.random.default_rng(seed)
    # A fixed number of episodes per environment, because the first episodes to end are shorter than the average.
    left = episodes // num_envs + (np.arange(num_envs) < episodes % num_envs)
    steps: list[dict[str, Any]] = []
    counted: list[Mask] = []
    observation, _ = env.reset(seed=seed)
    limit = getattr(env.unwrapped, "max_episode_steps", None if env.spec is None else env.spec.max_episode_steps)
    longest = _LONGEST_EPISODE if limit is None or limit == np.inf else max(_LONGEST_EPISODE, int(limit))
    start, lengths = np.ones(num_envs, np.bool_), np.zeros(num_envs, np.int64)
    while left.any():
        lengths = np.where(start, 1, lengths + 1)
        if lengths.max() > longest:
            raise ConfigurationError(
                f"an episode for the demonstrations has not ended after {longest:,} steps; add a time limit: "
                "--set 'wrappers=[{name: gymnasium.wrappers:TimeLimit, max_episode_steps: 1000}]'."
            )
        step = {"observation": _apply(np.array, observation), "episode_start": start}
        action = executed = clipped(policy.act(observation, start), space)
        if noise and isinstance(space, spaces.Box):
            executed = clipped(action + noise * generator.standard_normal(action.shape), space)
        observation, reward, terminated, truncated, info = env.step(executed)
        start = terminated | truncated
        if following:
            final = _apply(np.array, observation)
            for row in np.flatnonzero(start).tolist():
                final = _apply(partial(_put, row), final, info["final_obs"][row])
            step["next_observation"] = final
        steps.append({**step, "action": np.array(action), "reward": np.array(reward), "terminated": terminated})
        counted.append(left > 0)
        left -= start & (left > 0)
    played = np.stack(counted)  # (steps, num_envs)
    names = list(steps[0])
    columns = {name: _by_environment([step.pop(name) for step in steps], played) for name in names}
    always = np.ones(played.sum(), np.bool_)
    return Demonstrations(**{"next_observation": None, "intervention": always, "complete": always, **columns})


def clipped(action: Action, space: gym.Space[Any]) -> Any:
    """Return actions as an environment receives them: rounded to the space's data type, and clipped to its bounds."""
    if not isinstance(space, spaces.Box):
        return action
    return np.clip(np.asarray(action, space.dtype), space.low, space.high)


def _read(
    folder: Path, env: gym.vector.VectorEnv[Any, Any, Any], mapping: str | None, following: bool
) -> Demonstrations:
    try:
        frobs_data: Any = import_module("frobs_data")
    except ImportError as error:
        raise MissingDependencyError("reading a data set", ["frobs-data"], "pip install frobs-data") from error
    arrays = frobs_data.training_arrays(folder, env, mapping)
    start = arrays["episode_start"]
    if not len(start):
        raise ConfigurationError(f"demonstrations: {folder} contains no steps; record some episodes.")
    end = np.append(start[1:], True)
    names = ("observation", "action", "reward", "terminated", "episode_start", "intervention")
    return Demonstrations(
        next_observation=take(arrays["observation"], np.arange(len(start)) + ~end) if following else None,
        complete=~end,
        **{name: arrays[name] for name in names},
    )


def take(observation: Any, rows: Array) -> Any:
    """Return rows of an array, or of each array of a dictionary."""
    return _apply(lambda part: part[rows], observation)


def _apply(function: Callable[..., Array], *observations: Any) -> Any:
    """Call a function with arrays, or for each key with the arrays of several dictionaries."""
    first = observations[0]
    if isinstance(first, dict):
        return {key: function(*(each[key] for each in observations)) for key in first}
    return function(*observations)


def _put(row: int, array: Array, value: Array) -> Array:
    array[row] = value
    return array


def _by_environment(column: list[Any], played: Mask) -> Any:
    """Join arrays (num_envs, …), one per step, so that the steps of an environment follow one another.

    The list is emptied, so that pictures are in memory once.

    Args:
        column: The arrays, or dictionaries of them.
        played: Whether a step of an environment is wanted, (steps, num_envs). The wanted ones are the first.
    """
    if isinstance(column[0], dict):
        return {key: _by_environment([part.pop(key) for part in column], played) for key in list(column[0])}
    first = np.cumsum(played.sum(axis=0)) - played.sum(axis=0)
    joined = np.empty((played.sum(), *column[0].shape[1:]), column[0].dtype)
    for step in reversed(range(len(column))):
        rows = np.flatnonzero(played[step])
        joined[first[rows] + step] = column.pop()[rows]
    return joined
