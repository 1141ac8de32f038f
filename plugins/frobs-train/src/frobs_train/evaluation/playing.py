"""Play a fixed number of episodes with a policy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Policy
from frobs_core.util.arrays import Floats
from frobs_train.environment_checks import has_time_limit
from frobs_train.logs.recorder import EpisodeRecorder, FinishedEpisodes


@dataclass(frozen=True, kw_only=True)
class OctantResult:
    """Success statistics of one octant of the goal box.

    Attributes:
        success_rate: Success rate, in [0, 1].
        episodes: Number of episodes with a goal in this octant.
    """

    success_rate: float
    episodes: int


def play_episodes(
    env: gym.vector.VectorEnv[Any, Any, Any],
    policy: Policy,
    episodes: int,
    seed: int,
    on_progress: Callable[[int], object] | None = None,
    longest_episode: int | None = None,
) -> EpisodeCounter:
    """Play an exact number of episodes in a vector environment with same-step autoreset.

    Each environment runs a fixed number of episodes, so that short episodes are not overrepresented. ``on_progress`` is
    called after each step with the number of finished episodes. For ``longest_episode``, see
    :func:`frobs_train.evaluate`.
    """
    counter = EpisodeCounter(env.num_envs, episodes, goal_reader(env), error_reader(env))
    recorder = EpisodeRecorder(env, counter.add, longest_episode=None if has_time_limit(env) else longest_episode)
    observation, _ = recorder.reset(seed=seed)
    counter.begin()
    episode_start = np.ones(env.num_envs, bool)
    while not counter.complete:
        observation, _, terminated, truncated, info = recorder.step(policy.act(observation, episode_start))
        episode_start = terminated | truncated
        counter.after_step(info)
        if on_progress is not None:
            on_progress(len(counter.rewards))
    return counter


class EpisodeCounter:
    """Collector for the results of a fixed number of episodes in each environment.

    ``rewards`` contains the undiscounted return of each episode, and ``lengths`` its control steps. ``successes``
    contains 1.0 or 0.0 for each episode, or is empty if the environment does not report success. ``steps_to_success``
    contains, for each successful episode, the number of control steps after which the environment reported success and
    then reported it at every step until the episode ended.
    """

    def __init__(
        self,
        num_envs: int,
        episodes: int,
        goals: tuple[Callable[[], Floats], Floats] | None = None,
        errors: tuple[Callable[[], Floats], int] | None = None,
    ) -> None:
        self._left = np.full(num_envs, episodes // num_envs)
        self._left[: episodes % num_envs] += 1
        self._goals, self._errors = goals, errors
        self._steps = np.zeros(num_envs, np.int64)  # steps since the start of the episode
        self._last_failure = np.zeros(num_envs, np.int64)  # last step of the running episode without success
        self._error_sum, self._error_count = 0.0, 0
        self._begun: Floats = np.empty((num_envs, 3))  # goals at the start of the episodes [m]
        self._ended: list[Floats] = []
        self._finished: FinishedEpisodes | None = None
        self.rewards: list[float] = []
        self.lengths: list[int] = []
        self.successes: list[float] = []
        self.steps_to_success: list[int] = []

    @property
    def complete(self) -> bool:
        """Whether every environment has finished its share of the episodes."""
        return not self._left.any()

    def begin(self) -> None:
        """Store the goals of the first episodes."""
        if self._goals is not None:
            self._begun[:] = self._goals[0]()

    def add(self, finished: FinishedEpisodes) -> None:
        """Add the results of the episodes that ended at a step."""
        counted = self._left[finished.env_ids] > 0
        self._left[finished.env_ids[counted]] -= 1
        self.rewards += finished.rewards[counted].tolist()
        self.lengths += finished.lengths[counted].tolist()
        if finished.successes is not None:
            self.successes += [0.0] * (len(self.rewards) - len(self.successes) - int(counted.sum()))  # not reported
            self.successes += finished.successes[counted].tolist()
            succeeded = finished.env_ids[counted & (finished.successes > 0.0)]
            self.steps_to_success += (self._last_failure[succeeded] + 1).tolist()
        self._ended.append(self._begun[finished.env_ids[counted]])
        self._finished = finished

    def after_step(self, info: Mapping[str, Any]) -> None:
        """Read the goals of episodes that began at this step, and the tracking errors and successes of the others."""
        self._steps += 1
        if self._finished is not None:
            self._steps[self._finished.env_ids] = 0
        fails = ~np.asarray(info.get("is_success", np.zeros(len(self._steps))), bool)
        np.copyto(self._last_failure, self._steps, where=fails | (self._steps == 0))
        if self._errors is not None:
            late = (self._steps > self._errors[1] // 2) & (self._left > 0)
            if late.any():
                self._error_sum += float(self._errors[0]()[late].sum())
                self._error_count += int(late.sum())
        if self._goals is not None and self._finished is not None:
            ids = self._finished.env_ids
            self._begun[ids] = self._goals[0]()[ids]
        self._finished = None

    @property
    def tracking_error(self) -> float | None:
        """Mean tracking error in the second half of each episode [m], or None if no error was recorded."""
        return self._error_sum / self._error_count if self._error_count else None

    def by_octant(self) -> dict[str, OctantResult] | None:
        """Return success statistics for each octant that contained a goal.

        Return None if goals or successes are not available.
        """
        if self._goals is None or not self.successes:
            return None
        above = np.concatenate(self._ended) > self._goals[1]  # (episodes, 3)
        successes = np.array(self.successes)
        result = {}
        for signs in sorted({tuple(row) for row in above.tolist()}):
            members = (above == signs).all(axis=1)
            name = "".join(f"{'+' if sign else '-'}{axis}" for sign, axis in zip(signs, "xyz", strict=True))
            result[name] = OctantResult(success_rate=float(successes[members].mean()), episodes=int(members.sum()))
        return result


def goal_reader(env: gym.vector.VectorEnv[Any, Any, Any]) -> tuple[Callable[[], Floats], Floats] | None:
    """Return a pair: a function that reads the goals, (num_envs, 3) [m], and the center of the goal box [m].

    Return None if the task has no goal positions.
    """
    task: Any = getattr(env.unwrapped, "task", None)
    low, high = getattr(task, "goal_low", None), getattr(task, "goal_high", None)
    if low is None or high is None or not hasattr(task, "goal") or np.shape(task.goal) != (env.num_envs, 3):
        return None
    return lambda: np.array(task.goal, np.float64), (np.asarray(low, np.float64) + np.asarray(high)) / 2.0


def error_reader(env: gym.vector.VectorEnv[Any, Any, Any]) -> tuple[Callable[[], Floats], int] | None:
    """Return a pair: a function that reads the tracking errors, (num_envs,) [m], and the time limit [steps].

    Return None if the task has no tracking error or the environment has no time limit.
    """
    task: Any = getattr(env.unwrapped, "task", None)
    error: Any = getattr(task, "tracking_error", None)
    limit = env.spec.max_episode_steps if env.spec is not None else None
    if limit is None or np.shape(error) != (env.num_envs,):
        return None
    return lambda: np.array(task.tracking_error, np.float64), limit
