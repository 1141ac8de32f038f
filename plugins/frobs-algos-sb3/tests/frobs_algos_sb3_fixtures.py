from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest

from frobs_core import plugins
from frobs_train.environments import make_vector_env

REACH = "frobs/Irb120Reach-v0"


@dataclass(frozen=True)
class Family:
    """The algorithms that a test is about: those in PyTorch, or those in JAX.

    Attributes:
        prefix: What the names of the algorithms begin with.
        weights: The file that holds the networks.
    """

    prefix: str = ""
    weights: str = "policy.pt"

    def __call__(self, name: str) -> Any:
        """Return the class of an algorithm."""
        return plugins.get_record("algorithm", self.prefix + name).load()


@pytest.fixture
def family() -> Family:
    return Family()


class Monitor:
    """Keeps what it is told."""

    def __init__(self, stop_at: int | None = None) -> None:
        self.rows: list[tuple[int, dict[str, float]]] = []
        self.offers: list[int] = []
        self.save_at: dict[int, Path] = {}
        self.on_offer: Callable[[int], None] = lambda steps: None
        self._stop_at = stop_at

    def is_due(self, steps: int) -> bool:
        """Always."""
        return True

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        self.rows.append((steps, dict(metrics)))
        return self._stop_at is None or steps < self._stop_at

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        self.offers.append(steps)
        self.on_offer(steps)
        if steps in self.save_at:
            self.save_at[steps].mkdir()
            save(self.save_at[steps])


@pytest.fixture
def monitor() -> Monitor:
    return Monitor()


@pytest.fixture
def stopping_monitor() -> Monitor:
    """Wants no more after 16 steps."""
    return Monitor(stop_at=16)


@pytest.fixture
def make() -> Any:
    """Makes vector environments, seeded, and closes them."""
    made: list[gym.vector.VectorEnv[Any, Any, Any]] = []

    def make(name: str = REACH, num_envs: int = 4, seed: int = 0, **kwargs: Any) -> gym.vector.VectorEnv[Any, Any, Any]:
        env = make_vector_env(name, num_envs, kwargs)
        made.append(env)
        env.reset(seed=seed)
        return env

    yield make
    for env in made:
        env.close()
