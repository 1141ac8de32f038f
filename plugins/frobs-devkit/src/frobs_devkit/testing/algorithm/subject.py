"""The algorithm that is checked, on a small environment of Gymnasium's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core.interfaces import Algorithm
from frobs_core.specs import AlgorithmRecord

_NUM_ENVS = 2


class Monitor:
    """Counts what it is told."""

    def __init__(self) -> None:
        self.steps: list[int] = []
        self.offers = 0

    def is_due(self, steps: int) -> bool:
        """Always."""
        return True

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Keep the steps, and go on."""
        self.steps.append(steps)
        return True

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Count, and want none."""
        self.offers += 1


@dataclass(frozen=True)
class AlgorithmUnderTest:
    """An algorithm by its record."""

    record: AlgorithmRecord
    id: str
    config: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 300

    def make_env(self) -> gym.vector.VectorEnv[Any, Any, Any]:
        """Make the environment as a run does: same-step autoreset, seeded."""
        env = gym.make_vec(
            self.id, _NUM_ENVS, vectorization_mode="sync", vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP}
        )
        env.reset(seed=3)
        return env

    @contextmanager
    def trained(self, steps: int | None = None, seed: int = 5) -> Iterator[tuple[Algorithm, Monitor]]:
        """Train a new algorithm for a moment."""
        monitor, cls = Monitor(), self.record.load()
        with closing(self.make_env()) as env:
            algorithm: Algorithm = cls(env, cls.resolve_config(self.config), seed)
            if steps != 0:
                algorithm.train(steps or self.steps, monitor)
            yield algorithm, monitor

    def observations(self, count: int) -> Any:
        """Draw observations of episodes; (count, …)."""
        with closing(gym.make(self.id)) as env:
            return np.stack([env.reset(seed=seed)[0] for seed in range(count)])
