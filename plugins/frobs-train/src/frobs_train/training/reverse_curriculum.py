"""Reverse curriculum, in which training episodes begin on the path of an expert, at first near the end of the path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from frobs_core import load_policy
from frobs_core.kernel.mixed_vector_env import MixedVectorEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.arrays import Floats, Mask, rows_of, widened
from frobs_core.util.errors import ConfigurationError, RunError
from frobs_train.configuration.config import ResetFromConfig
from frobs_train.logs.recorder import FROM_PATH

_WITHOUT = "to train without reset_from, pass --set reset_from=null"

_AT_FRONT = 0.5
"""Probability that an episode that begins on the expert's path begins at the front. Otherwise, the episode begins
between the front and the end of the path."""

_EPISODES = 50  # number of episodes that must have begun at the front before the front can move


class ReverseCurriculum(gym.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """Wrapper that starts some episodes in states that the task's expert has visited.

    The expert first acts for one episode in each environment. Each successful episode is a path that provides states at
    equal time intervals. The ``front`` is the index of the earliest state in which an episode may begin, where 0 is the
    start of the path. The front moves from the end of the path to the start, by one state whenever enough of the
    episodes that began at the front have succeeded. An episode that begins on the path inherits the remaining time,
    goals, objects and randomized parameters of the expert's episode.

    ``final_info`` contains ``frobs/from_path``, (num_envs,) bool: whether the finished episode began on the path.

    On several simulators, each has its own path and its own front.

    The constructor raises RunError if the environment is not a native vector environment with same-step autoreset and a
    time limit, its task has no expert, or the expert does not support the controllers or never succeeds.
    """

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: ResetFromConfig, seed: int) -> None:
        super().__init__(env)
        base: Any = env.unwrapped
        if not isinstance(base, RobotVectorEnv | MixedVectorEnv) or base.max_episode_steps == np.inf:
            raise RunError(f"reset_from needs a native vector environment of FRobs with a time limit; {_WITHOUT}.")
        parts = base.parts.values() if isinstance(base, MixedVectorEnv) else [base]
        firsts = np.cumsum([0, *(part.num_envs for part in parts)])
        self.curricula = [
            _Curriculum(part, config, seed + int(first)) for part, first in zip(parts, firsts, strict=False)
        ]
        self._ends = firsts[1:-1]

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step the environments, and count the successes of episodes that began at the front."""
        began = [each.state.copy() for each in self.curricula]
        observation, rewards, terminated, truncated, info = self.env.step(actions)
        done = terminated | truncated
        if done.any():
            final = info["final_info"]
            final[FROM_PATH] = np.concatenate(began) >= 0
            successes, ended = (np.split(array, self._ends) for array in (final["is_success"], done))
            for curriculum, state, succeeded, over in zip(self.curricula, began, successes, ended, strict=True):
                curriculum.count(succeeded[over & (state == curriculum.front)])
        return observation, rewards, terminated, truncated, info

    def metrics(self) -> dict[str, float]:
        """Return the position of the front on the path for the log, as a fraction in [0, 1]: the simulators' mean."""
        return {"curriculum/front": float(np.mean([each.front / each.last for each in self.curricula]))}

    def snapshot(self) -> dict[str, np.ndarray[Any, Any]]:
        """Return the state of the curriculum without the expert's path, which is reproduced from the seed."""
        counts = np.array([[each.front, each.episodes, each.successes] for each in self.curricula])
        return {"state": np.concatenate([each.state for each in self.curricula]), "counts": counts.ravel()}

    def restore(self, snapshot: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """Restore a snapshot."""
        counts, states = snapshot["counts"].reshape(-1, 3).tolist(), np.split(snapshot["state"], self._ends)
        for each, state, numbers in zip(self.curricula, states, counts, strict=True):
            each.state[:] = state
            each.front, each.episodes, each.successes = numbers


class _Curriculum:
    """Curriculum of the environments on one simulator. For the arguments and errors, see :class:`ReverseCurriculum`.

    Attributes:
        front: Index of the earliest state in which an episode may begin, where 0 is the start of the path.
        last: Index of the end of the path.
        state: Index of the state in which each running episode began, (num_envs,), or −1 if it did not begin on the path.
        episodes: Number of finished episodes that began at the front.
        successes: Number of successful ones.
    """

    def __init__(self, env: RobotVectorEnv, config: ResetFromConfig, seed: int) -> None:
        self._env, self._config = env, config
        self._path, self._rows = _expert_path(env, config.states, seed)
        self.front = self.last = config.states - 1
        self.state = np.full(env.num_envs, -1)
        self.episodes = self.successes = 0
        env.after_reset.append(self._begin)

    def _begin(self, mask: Mask | None) -> None:
        """Move some of the environments selected by ``mask`` to states on the path."""
        rows, rng, num_envs = rows_of(mask), self._env.step_context.rng, self._env.num_envs
        drawn = rng.uniform("reset_from", shape=(4,), mask=mask)
        on_path = drawn[:, 0] < self._probability()
        at_front, behind, episode = drawn[on_path, 1:].T
        state = np.where(at_front < _AT_FRONT, self.front, self.front + _floor(behind * (self.last + 1 - self.front)))
        begun = np.full(len(drawn), -1)
        begun[on_path] = state
        self.state[rows] = begun
        chosen = np.zeros(num_envs, np.bool_)
        chosen[rows] = on_path
        if on_path.any():
            places = state * num_envs + self._rows[_floor(episode * len(self._rows))]
            self._env.restore_rows(chosen, self._path, places)

    def _probability(self) -> float:
        """Return the probability that an episode begins on the path.

        Episodes from the path are shorter, so more of them are needed for the configured share of the steps.
        """
        states, share = self._config.states, self._config.share
        mean = _AT_FRONT * self.front + (1.0 - _AT_FRONT) * (self.front + states - 1) / 2
        length = 1.0 - mean / states  # mean length of an episode from the path, relative to the other episodes
        return share / (share + (1.0 - share) * length)

    def count(self, successes: np.ndarray[Any, Any]) -> None:
        """Count finished episodes that began at the front, given whether each succeeded, and move the front."""
        self.episodes += len(successes)
        self.successes += int(successes.sum())
        if self.episodes >= _EPISODES:
            if self.successes >= self._config.success * self.episodes:
                self.front = max(0, self.front - 1)
            self.episodes = self.successes = 0


def _floor(values: Floats) -> npt.NDArray[np.int64]:
    return np.floor(values).astype(np.int64)


def _expert_path(
    env: RobotVectorEnv, states: int, seed: int
) -> tuple[dict[str, np.ndarray[Any, Any]], np.ndarray[Any, Any]]:
    """Run the expert for one episode in each environment.

    Return concatenated snapshots, (states · num_envs, …), and the indices of the environments that succeeded.
    """
    try:
        expert = load_policy("expert", env)
    except RunError as error:
        raise RunError(f"reset_from needs a task with an expert; {_WITHOUT}.") from error
    except ConfigurationError as error:
        raise RunError(f"reset_from: {str(error).rstrip('.')}; {_WITHOUT}.") from error
    # with a mask, reset() does not shorten (stagger) the first episodes
    observation, _ = env.reset(seed=seed, options={"reset_mask": np.ones(env.num_envs, np.bool_)})
    steps = int(env.max_episode_steps)
    taken = np.linspace(0, steps - 1, states).astype(int)
    snapshots = []
    begins, broken = np.ones(env.num_envs, np.bool_), np.zeros(env.num_envs, np.bool_)
    for step in range(steps):
        if step in taken:
            snapshots += [env.snapshot()] * int((taken == step).sum())
        broken |= begins & (step > 0)  # an episode ended before the time limit
        observation, _, terminated, truncated, info = env.step(expert.act(observation, begins))
        begins = terminated | truncated
    expert.close()
    successes = info["final_info"]["is_success"] if begins.any() else np.zeros(env.num_envs)
    succeeded = np.flatnonzero(begins & ~broken & (successes > 0.0))
    if not len(succeeded):
        raise RunError(
            f"reset_from: none of the expert's {env.num_envs} episodes lasted until the time limit and ended in "
            f"success, so training episodes have no path to start from; {_WITHOUT}."
        )
    widest = {name: max(snapshot[name].shape[1:] for snapshot in snapshots) for name in snapshots[0]}
    return {
        name: np.concatenate([widened(each[name], widest[name]) for each in snapshots]) for name in widest
    }, succeeded
