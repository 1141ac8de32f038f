"""The algorithm that is checked, on a small environment of Gymnasium's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

from frobs_core.interfaces import Algorithm
from frobs_core.specs import AlgorithmRecord

ENVIRONMENTS = {"Box": "Pendulum-v1", "Discrete": "CartPole-v1"}
"""What an algorithm is tried on, by its action space."""

_NUM_ENVS = 2


class Watched(gym.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """Counts the steps of every environment. Keeps the first actions outside the space, and the seeds of resets."""

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self.taken = 0
        self.outside: Any = None
        self.seeds: list[Any] = []

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Keep the seed, and reset."""
        if seed is not None:
            self.seeds.append(seed)
        return super().reset(seed=seed, options=options)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Count, compare, and step."""
        self.taken += self.num_envs
        if self.outside is None and not self.action_space.contains(np.asarray(actions, self.action_space.dtype)):
            self.outside = np.array(actions)
        return super().step(actions)


class Monitor:
    """Keeps what it is told: the rows of the log and the steps of checkpoints that are offered."""

    def __init__(self, env: Watched) -> None:
        self.env = env
        self.steps: list[int] = []
        self.taken: list[int] = []  # environment steps, as they were counted when the rows were told
        self.rows: list[dict[str, float]] = []
        self.offers: list[int] = []

    def is_due(self, steps: int) -> bool:
        """Always."""
        return True

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Keep the row, and go on."""
        self.steps.append(steps)
        self.taken.append(self.env.taken)
        self.rows.append(dict(metrics))
        return True

    def on_episodes(self, rewards: Any, lengths: Any, successes: Any = None, terms: Any = None) -> None:
        """Ignore episodes of other environments."""

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Keep the steps, and want no checkpoint."""
        self.offers.append(steps)


@dataclass(frozen=True, eq=False)
class AlgorithmUnderTest:
    """An algorithm by its record, with the ID and the settings that it is tried with."""

    record: AlgorithmRecord
    id: str | EnvSpec
    config: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 300

    @property
    def has_kit_environment(self) -> bool:
        """Whether nobody chose the environment."""
        return self.id in ENVIRONMENTS.values()

    def make_env(self, max_episode_steps: int | None = None) -> Watched:
        """Make the environment as a run does: same-step autoreset, seeded."""
        limit: dict[str, Any] = {} if max_episode_steps is None else {"max_episode_steps": max_episode_steps}
        env = gym.make_vec(
            self.id,
            _NUM_ENVS,
            vectorization_mode="sync",
            vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP},
            **limit,
        )
        env.reset(seed=3)
        return Watched(env)

    def make(self, env: Watched, seed: int = 5) -> Algorithm:
        """Make the algorithm, untrained."""
        cls: type[Algorithm] = self.record.load()
        return cls(env, cls.resolve_config(self.config), seed)

    def train(
        self, steps: int, seed: int = 5, monitor: Callable[[Watched], Monitor] = Monitor
    ) -> tuple[Algorithm, Monitor]:
        """Train a new algorithm, and return it with what it told."""
        with closing(self.make_env()) as env:
            algorithm, told = self.make(env, seed), monitor(env)
            algorithm.train(steps, told)
            return algorithm, told

    @cached_property
    def untrained(self) -> Algorithm:
        """An algorithm before its training."""
        with closing(self.make_env()) as env:
            return self.make(env)

    @cached_property
    def trained(self) -> tuple[Algorithm, Monitor]:
        """An algorithm after :attr:`steps`, and what it told; several checks look at this one."""
        return self.train(self.steps)

    @property
    def enough(self) -> int:
        """Environment steps in which at least four iterations begin, by what a first training told."""
        told = [0, *self.trained[1].steps]
        return max(self.steps, 4 * max(b - a for a, b in zip(told, told[1:] or told, strict=False)))

    def observations(self, count: int) -> Any:
        """Draw observations of episodes; (count, …)."""
        with closing(gym.make(self.id)) as env:
            return np.stack([env.reset(seed=seed)[0] for seed in range(count)])
