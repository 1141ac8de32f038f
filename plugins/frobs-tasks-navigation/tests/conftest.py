from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium as gym
import pytest

import frobs_core  # noqa: F401 - registers the IDs


@pytest.fixture
def make() -> Iterator[Callable[..., Any]]:
    """Make an environment: with ``num_envs`` the native batch, else the single one as ``gym.make`` gives it."""
    made = []

    def build(id: str, num_envs: int | None = None, **parameters: Any) -> Any:
        if num_envs is None:
            env = gym.make(id, **parameters)
        else:
            env = gym.make_vec(id, num_envs=num_envs, vectorization_mode="vector_entry_point", **parameters)
        made.append(env)
        return env

    yield build
    for env in made:
        env.close()
