"""Evaluating what a run has learned, on episodes that it has never seen."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError
from frobs_core.interfaces.algorithm import Algorithm
from frobs_core.runs.environments import find_spec, make_vector_env
from frobs_core.runs.files import write_json
from frobs_core.runs.policy import load_policy
from frobs_core.runs.recorder import EpisodeRecorder, FinishedEpisodes
from frobs_core.runs.run import Run
from frobs_core.runs.seeds import spread_seed
from frobs_core.yaml import plain


@dataclass(frozen=True, kw_only=True)
class OctantResult:
    """Success in one eighth of the goal box.

    Attributes:
        success_rate: In [0, 1].
        episodes: How many had their goal there.
    """

    success_rate: float
    episodes: int


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """What an evaluation found.

    Attributes:
        success_rate: Share of the episodes that ended in success; None where the environment does not say.
        success_interval: Wilson's 95 % interval of it.
        mean_reward: Undiscounted, per episode.
        mean_length: [control steps]
        episodes: How many.
        success_by_octant: By the signs of the goal relative to the middle of the goal box (``"+x-y+z"``); None where
            the task has no goal positions.
        environment: Gymnasium ID.
        simulator: Where another than the training's was asked for.
        randomize: What was randomised; None: nothing, the nominal models.
        seed: That the episodes come from.
        deterministic: Whether the policy's mode was taken.
        steps: Environment steps that the policy had trained for.
    """

    success_rate: float | None
    success_interval: tuple[float, float] | None
    mean_reward: float
    mean_length: float
    episodes: int
    success_by_octant: Mapping[str, OctantResult] | None
    environment: str
    simulator: str | None
    randomize: Mapping[str, Any] | None
    seed: int
    deterministic: bool
    steps: int

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return asdict(self)


def evaluate(
    run: Run,
    episodes: int = 1000,
    *,
    simulator: str | None = None,
    randomize: bool | Mapping[str, Any] = False,
    seed: int | None = None,
    num_envs: int | None = None,
    deterministic: bool = True,
) -> Evaluation:
    """Evaluate the newest checkpoint, and write the result into the run's ``evaluations/``.

    Every environment plays a number of episodes that is fixed beforehand, so that short episodes do not count more.
    Their seeds are never those of a training.

    Args:
        run: The run.
        episodes: Exactly so many, ≥ 1.
        simulator: Another one than the training's.
        randomize: False: the nominal models; True: as in the training; or what to randomise instead.
        seed: ≥ 0; None: the run's.
        num_envs: How many are stepped together, ≥ 1.
        deterministic: Take the mode of the policy, or else sample.

    Raises:
        CheckpointError: No checkpoint is usable.
        ConfigurationError: A number is out of range.
        RunError: The environment is not the one of the training.
    """
    config = run.config
    chosen_seed = config.seed if seed is None else seed
    assert chosen_seed is not None
    if num_envs is None:
        num_envs = min(episodes, 256 if find_spec(config.environment).vector_entry_point is not None else 16)
    for name, value, least in (("episodes", episodes, 1), ("num_envs", num_envs, 1), ("seed", chosen_seed, 0)):
        if value < least:
            raise ConfigurationError(f"{name} = {value}: it must be at least {least}.")
    kwargs = config.keywords(simulator=simulator, randomize=randomize)
    randomized = plain(kwargs.get("randomize"))
    env = make_vector_env(config.environment, min(num_envs, episodes), kwargs)
    try:
        policy, steps = load_policy(run, env.single_observation_space, env.single_action_space)
        counter = _Counter(env.num_envs, episodes, goal_reader(env))
        recorder = EpisodeRecorder(env, counter.add)
        _play(recorder, policy, spread_seed(chosen_seed).evaluation, deterministic, counter)
    finally:
        env.close()
    successes = counter.successes
    result = Evaluation(
        success_rate=float(np.mean(successes)) if successes else None,
        success_interval=wilson_interval(int(sum(successes)), len(successes)) if successes else None,
        mean_reward=float(np.mean(counter.rewards)),
        mean_length=float(np.mean(counter.lengths)),
        episodes=len(counter.rewards),
        success_by_octant=counter.by_octant(),
        environment=config.environment,
        simulator=simulator,
        randomize=randomized,
        seed=chosen_seed,
        deterministic=deterministic,
        steps=steps,
    )
    name = f"step_{steps:09d}_seed{chosen_seed}_{episodes}episodes{f'_{simulator}' if simulator else ''}"
    if randomized:
        name += "_randomized" if randomize is True else f"_randomized-{_digest(randomized)}"
    write_json(run.path / "evaluations" / f"{name}.json", result.to_dict())
    return result


def _digest(settings: Mapping[str, Any]) -> str:
    """Return a short name of settings, so that evaluations with others stand beside each other."""
    return hashlib.blake2b(json.dumps(settings, sort_keys=True).encode(), digest_size=4).hexdigest()


def _play(env: EpisodeRecorder, policy: Algorithm, seed: int, deterministic: bool, counter: _Counter) -> None:
    observation, _ = env.reset(seed=seed)
    counter.begin()
    state = None
    episode_start = np.ones(env.num_envs, bool)
    while not counter.complete:
        action, state = policy.predict(observation, state, episode_start, deterministic)
        observation, _, terminated, truncated, _ = env.step(action)
        episode_start = terminated | truncated
        counter.after_step()


class _Counter:
    """Takes the first so many episodes of each environment."""

    def __init__(self, num_envs: int, episodes: int, goals: tuple[Callable[[], Floats], Floats] | None) -> None:
        self._left = np.full(num_envs, episodes // num_envs)
        self._left[: episodes % num_envs] += 1
        self._goals = goals
        self._begun: Floats = np.empty((num_envs, 3))  # goals at the episodes' starts
        self._ended: list[Floats] = []
        self._finished: FinishedEpisodes | None = None
        self.rewards: list[float] = []
        self.lengths: list[int] = []
        self.successes: list[float] = []

    @property
    def complete(self) -> bool:
        """Whether every environment has played its number of episodes."""
        return not self._left.any()

    def begin(self) -> None:
        """Remember the first goals."""
        if self._goals is not None:
            self._begun[:] = self._goals[0]()

    def add(self, finished: FinishedEpisodes) -> None:
        """Count episodes."""
        wanted = self._left[finished.env_ids] > 0
        self._left[finished.env_ids[wanted]] -= 1
        self.rewards += finished.rewards[wanted].tolist()
        self.lengths += finished.lengths[wanted].tolist()
        if finished.successes is not None:
            self.successes += finished.successes[wanted].tolist()
        self._ended.append(self._begun[finished.env_ids[wanted]])
        self._finished = finished

    def after_step(self) -> None:
        """Remember the goals of the episodes that have begun in the step."""
        if self._goals is not None and self._finished is not None:
            ids = self._finished.env_ids
            self._begun[ids] = self._goals[0]()[ids]
        self._finished = None

    def by_octant(self) -> dict[str, OctantResult] | None:
        """Return the success in each octant that had a goal."""
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
    """Return how to read the goals, (num_envs, 3) [m], and the middle of their box.

    None where the task has no ``goal`` of that shape, or no ``goal_low`` and ``goal_high``.
    """
    task: Any = getattr(env.unwrapped, "task", None)
    low, high = getattr(task, "goal_low", None), getattr(task, "goal_high", None)
    if low is None or high is None or not hasattr(task, "goal") or np.shape(task.goal) != (env.num_envs, 3):
        return None
    return lambda: np.array(task.goal, np.float64), (np.asarray(low, np.float64) + np.asarray(high)) / 2.0


def wilson_interval(successes: int, episodes: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a proportion (Wilson 1927), in [0, 1]."""
    z = 1.959963984540054  # 97.5 % quantile of the normal distribution
    rate = successes / episodes
    scale = 1.0 + z * z / episodes
    middle = (rate + z * z / (2 * episodes)) / scale
    half = z * math.sqrt(rate * (1.0 - rate) / episodes + z * z / (4 * episodes * episodes)) / scale
    return max(0.0, middle - half), min(1.0, middle + half)
