"""Demonstrations: the transitions of whole episodes, from a recorded data set or played by a policy."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core import load_policy
from frobs_core.description import Observation
from frobs_core.kernel.policies import is_path
from frobs_core.util.arrays import Action, Floats, Mask
from frobs_core.util.errors import ConfigurationError, IncompatibleSpaceError, MissingDependencyError

__all__ = ["Demonstrations", "clipped", "collect", "load_demonstrations"]

_MOST_ENVS = 64


@dataclass(frozen=True, kw_only=True, eq=False)
class Demonstrations:
    """The n steps of whole episodes, one episode after another.

    Attributes:
        observation: Observations before the actions, (n, …) or a dictionary of such arrays.
        action: Actions as the environment received them, (n, …).
        reward: (n,) float32.
        terminated: (n,) bool, True at the last step of an episode that reached a terminal state.
        episode_start: (n,) bool, True at the first step of each episode.
    """

    observation: Observation
    action: np.ndarray[Any, Any]
    reward: Floats
    terminated: Mask
    episode_start: Mask


def load_demonstrations(
    source: str, env: gym.vector.VectorEnv[Any, Any, Any], episodes: int, seed: int
) -> Demonstrations:
    """Return the demonstrations that a setting names.

    Args:
        source: Folder of a recorded data set, or the name or path of a policy such as ``"expert"``.
        env: The environment of a training run, whose observations and actions the demonstrations must have.
        episodes: Number of episodes that a policy plays. A data set is used as a whole.
        seed: Seed of the episodes that a policy plays.

    Raises:
        FrobsError: The source does not exist, or its robot, observations or actions are different.
    """
    if is_path(source) and _is_data_set(source):
        if find_spec("frobs_data") is None:
            raise MissingDependencyError("a recorded data set", ["frobs-data"], "pip install frobs-data")
        from frobs_data import training_arrays

        arrays = training_arrays(source, env)
        return Demonstrations(
            observation=arrays["observation"],
            action=arrays["action"],
            reward=arrays["reward"],
            terminated=arrays["terminated"],
            episode_start=arrays["episode_start"],
        )
    return collect(env, source, episodes, seed)


def collect(env: gym.vector.VectorEnv[Any, Any, Any], policy: str, episodes: int, seed: int) -> Demonstrations:
    """Play whole episodes with a policy, in new environments like those of a training run.

    Args:
        env: The environment of a training run, which is not stepped.
        policy: Name or path of the policy.
        episodes: Number of episodes, ≥ 1.
        seed: Seed of the episodes.

    Raises:
        FrobsError: The policy does not exist, or cannot act in the environment.
    """
    recipe = getattr(env, "recipe", None)
    if recipe is None:
        raise ConfigurationError(f"policy '{policy}' can play demonstrations only for a run that FRobs trains.")
    playing = recipe.make(min(episodes, _MOST_ENVS), 1)
    try:
        with closing(load_policy(policy, playing)) as actor:
            return _play(playing, actor, episodes, seed)
    finally:
        playing.close()


def clipped(action: Action, space: gym.spaces.Box) -> np.ndarray[Any, Any]:
    """Return actions as an environment receives them: rounded to the space's data type, and clipped to its bounds."""
    return np.clip(np.asarray(action, space.dtype), space.low, space.high)


def _is_data_set(source: str) -> bool:
    from pathlib import Path

    return (Path(source) / "meta" / "info.json").exists()


def _play(env: gym.vector.VectorEnv[Any, Any, Any], policy: Any, episodes: int, seed: int) -> Demonstrations:
    space = env.single_action_space
    if not isinstance(space, gym.spaces.Box):
        raise IncompatibleSpaceError("demonstrations", space, f"need actions with bounds, but the space is {space}.")
    left = np.full(env.num_envs, episodes // env.num_envs)
    left[: episodes % env.num_envs] += 1
    rows: list[list[tuple[Any, ...]]] = [[] for _ in range(env.num_envs)]
    observation, _ = env.reset(seed=seed)
    start = np.ones(env.num_envs, np.bool_)
    while left.any():
        action = clipped(policy.act(observation, start), space)
        following, reward, terminated, truncated, _ = env.step(action)
        for row in np.flatnonzero(left > 0).tolist():
            seen = _row(observation, row)
            rows[row].append((seen, action[row].copy(), reward[row], terminated[row], start[row]))
        start = terminated | truncated
        left[start & (left > 0)] -= 1
        observation = following
    steps = [step for one in rows for step in one]
    return Demonstrations(
        observation=_stack([step[0] for step in steps]),
        action=np.stack([step[1] for step in steps]),
        reward=np.array([step[2] for step in steps], np.float32),
        terminated=np.array([step[3] for step in steps], np.bool_),
        episode_start=np.array([step[4] for step in steps], np.bool_),
    )


def _row(observation: Observation, row: int) -> Any:
    if isinstance(observation, Mapping):
        return {key: value[row].copy() for key, value in observation.items()}
    return observation[row].copy()


def _stack(observations: list[Any]) -> Observation:
    if isinstance(observations[0], Mapping):
        return {key: np.stack([one[key] for one in observations]) for key in observations[0]}
    return np.stack(observations)
