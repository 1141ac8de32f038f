from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest

from frobs_core import plugins
from frobs_ray.cluster import connect
from frobs_train.environments import EnvironmentRecipe, make_vector_env
from frobs_train.logs.recorder import EpisodeRecorder

REACH = "frobs/Irb120Reach-v0"
SHORT: dict[str, dict[str, Any]] = {
    "rllib_ppo": {"n_steps": 8, "batch_size": 16, "n_epochs": 2, "policy_kwargs": {"net_arch": [8]}},
    "rllib_sac": {"batch_size": 16, "buffer_size": 500, "learning_starts": 32, "policy_kwargs": {"net_arch": [8]}},
    "rllib_appo": {"n_steps": 8, "batch_size": 32, "policy_kwargs": {"net_arch": [8]}},
}


class Monitor:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.rows: list[tuple[int, dict[str, float]]] = []
        self.offers: list[int] = []
        self.episodes: list[dict[str, Any]] = []
        self.is_enough: Callable[[int], bool] = lambda steps: False
        self.on_row: Callable[[int], None] = lambda steps: None

    def is_due(self, steps: int) -> bool:
        return True

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        self.rows.append((steps, dict(metrics)))
        self.on_row(steps)
        return not self.is_enough(steps)

    def on_episodes(self, rewards: Any, lengths: Any, successes: Any = None, terms: Any = None) -> None:
        self.episodes.append({"rewards": rewards, "lengths": lengths, "successes": successes, "terms": terms})

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        self.offers.append(steps)


@pytest.fixture
def monitor() -> Monitor:
    return Monitor()


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    """Keeps one Ray cluster for all tests of a module: to start one takes seconds."""
    with connect(num_cpus=2):
        yield


@pytest.fixture
def make() -> Iterator[Any]:
    """Makes an algorithm with its environment, as a run does, and closes the environments."""
    made: list[gym.vector.VectorEnv[Any, Any, Any]] = []

    def make_env(id: str = REACH, num_envs: int = 4, **kwargs: Any) -> EpisodeRecorder:
        env = make_vector_env(id, num_envs, kwargs)
        made.append(env)
        env.reset(seed=0)
        return EpisodeRecorder(env, lambda finished: None, EnvironmentRecipe(id, kwargs))

    def make(name: str, config: Mapping[str, Any] | None = None, id: str = REACH, seed: int = 1, **kwargs: Any) -> Any:
        cls = plugins.get_record("algorithm", name).load()
        return cls(make_env(id, **kwargs), {**SHORT[name], **(config or {})}, seed)

    make.env = make_env  # type: ignore[attr-defined]
    yield make
    for env in made:
        env.close()
