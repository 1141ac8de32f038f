"""The algorithm that is checked, on a small environment of Gymnasium's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
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
    """An algorithm by its record.

    Attributes:
        record: Its record.
        id: What it is tried on.
        config: Its settings.
        steps: Environment steps of a training.
    """

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
        env, monitor = self.make_env(), Monitor()
        try:
            cls: type[Algorithm] = self.record.load()
            algorithm = cls(env, cls.resolve_config(self.config), seed)
            if steps != 0:
                algorithm.train(steps or self.steps, monitor)
            yield algorithm, monitor
        finally:
            env.close()

    def observations(self, count: int) -> Any:
        """Draw observations of episodes; (count, …)."""
        env = gym.make(self.id)
        drawn = [env.reset(seed=seed)[0] for seed in range(count)]
        env.close()
        return np.stack(drawn)
