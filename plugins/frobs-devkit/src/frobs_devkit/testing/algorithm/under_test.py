"""The algorithm to check, with its training environment and training runs."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

from frobs_core.contracts import Algorithm
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.validation import plain_settings
from frobs_devkit.testing.checks import Inconclusive, NotApplicable
from frobs_devkit.testing.compare import difference

ENVIRONMENTS = {"Box": "Pendulum-v1", "Discrete": "CartPole-v1"}
"""Default environment ID for each type of action space."""

DISCOUNT = "gamma"
"""Name of the setting that is the discount factor."""

_NUM_ENVS = 2


class Watched(gym.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """A vector wrapper that counts steps, and stores reset seeds and the first actions outside the action space.

    Two training runs with the same checksum of all ``actions`` explore in the same way, so they have the same weights
    and random numbers. Predictions alone would not show this for discrete actions.
    """

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self.taken = 0
        self.outside: Any = None
        self.seeds: list[Any] = []
        self.actions = 0

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Store the seed, and reset the environments."""
        if seed is not None:
            self.seeds.append(seed)
        return super().reset(seed=seed, options=options)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Count the steps, check the actions, and step the environments."""
        self.taken += self.num_envs
        self.actions = zlib.crc32(np.ascontiguousarray(actions).tobytes(), self.actions)
        if self.outside is None and not self.action_space.contains(np.asarray(actions, self.action_space.dtype)):
            self.outside = np.array(actions)
        return super().step(actions)


class Monitor:
    """A training monitor that stores the reported metrics and the step counts of offered checkpoints."""

    def __init__(self, env: Watched) -> None:
        self.env = env
        self.steps: list[int] = []
        self.taken: list[int] = []  # number of environment steps at each report
        self.rows: list[dict[str, float]] = []
        self.offers: list[int] = []

    def is_due(self, steps: int) -> bool:
        """Return True."""
        return True

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Store the metrics and continue training."""
        self.steps.append(steps)
        self.taken.append(self.env.taken)
        self.rows.append(dict(metrics))
        return True

    def on_episodes(self, rewards: Any, lengths: Any, successes: Any = None, terms: Any = None) -> None:
        """Ignore episodes in environments that the algorithm created itself."""

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Store the step count without saving a checkpoint."""
        self.offers.append(steps)


Run: TypeAlias = tuple[Algorithm, Monitor]
"""A trained algorithm and the monitor of its training run."""


@dataclass(frozen=True, eq=False)
class AlgorithmUnderTest:
    """The record of an algorithm, with the environment ID and the settings for its checks."""

    record: AlgorithmRecord
    id: str | EnvSpec
    config: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 300

    @property
    def has_kit_environment(self) -> bool:
        """Whether the environment is one of the kit's default environments."""
        return self.id in ENVIRONMENTS.values()

    @property
    def settings(self) -> dict[str, Any]:
        """The resolved settings, as YAML-serializable values."""
        return plain_settings(self.record.load().resolve_config(self.config))

    def require_reproducible(self) -> None:
        """Raise NotApplicable unless training with the same seed gives the same result."""
        if not self.record.reproducible:
            raise NotApplicable("the algorithm's record declares reproducible=False")

    def require_learning(self) -> None:
        """Raise Inconclusive if training changed no prediction."""
        if difference(self.predictions(self.untrained), self.predictions(self.trained[0])) is None:
            raise Inconclusive(f"{self.steps} steps changed no prediction")

    def make_env(self, max_episode_steps: int | None = None, wrap: Callable[[Any], Any] | None = None) -> Watched:
        """Create a seeded vector environment with same-step autoreset, as in a training run."""
        limit: dict[str, Any] = {} if max_episode_steps is None else {"max_episode_steps": max_episode_steps}
        env = gym.make_vec(
            self.id,
            _NUM_ENVS,
            vectorization_mode="sync",
            vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP},
            **limit,
        )
        env.reset(seed=3)
        return Watched(env if wrap is None else wrap(env))

    def make(self, env: Watched, seed: int = 5) -> Algorithm:
        """Create the untrained algorithm."""
        cls: type[Algorithm] = self.record.load()
        return cls(env, cls.resolve_config(self.config), seed)

    def train(
        self, steps: int, seed: int = 5, monitor: Callable[[Watched], Monitor] = Monitor, **environment: Any
    ) -> Run:
        """Train a new algorithm, and return the algorithm and its monitor. Other arguments are for ``make_env``."""
        with closing(self.make_env(**environment)) as env:
            algorithm, run_monitor = self.make(env, seed), monitor(env)
            algorithm.train(steps, run_monitor)
            return algorithm, run_monitor

    @cached_property
    def untrained(self) -> Algorithm:
        """The algorithm before training."""
        with closing(self.make_env()) as env:
            return self.make(env)

    @cached_property
    def trained(self) -> Run:
        """The algorithm after training for :attr:`steps` steps, and its monitor.

        Several checks share this training run.
        """
        return self.train(self.steps)

    @property
    def enough(self) -> int:
        """Number of environment steps needed for at least four iterations, estimated from a first training run."""
        ends = [0, *self.trained[1].steps]
        return max(self.steps, 4 * max(b - a for a, b in zip(ends, ends[1:] or ends, strict=False)))

    def different(self, one: Run, other: Run) -> str | None:
        """Return how two training runs differ in actions, metrics or predictions, or None if they are identical."""
        if one[1].env.actions != other[1].env.actions:
            return "the actions during training differ"
        for steps, expected, actual in zip(one[1].steps, one[1].rows, other[1].rows, strict=False):
            text = difference(expected, actual)
            if text:
                return f"the metrics at step {steps} differ: {text}"
        text = difference(self.predictions(one[0]), self.predictions(other[0]))
        return f"the predictions differ: {text}" if text else None

    def predictions(self, algorithm: Algorithm) -> Any:
        """Return the deterministic actions of an algorithm for the first observations of eight episodes."""
        return algorithm.predict(self.observations(8))[0]

    def observations(self, count: int) -> Any:
        """Return the first observations of ``count`` episodes, (count, …)."""
        with closing(gym.make(self.id)) as env:
            return np.stack([env.reset(seed=seed)[0] for seed in range(count)])
