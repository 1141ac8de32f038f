from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv

sys.path.insert(0, str(Path(__file__).parent))  # where sliding.py is

PARTS = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}


@pytest.fixture
def make() -> Iterator[Callable[..., Any]]:
    """Make an environment of the IRB 120: ``make(num_envs, randomize, **keywords)``; num_envs None: the single one."""
    made = []

    def build(num_envs: int | None, randomize: Any = None, **keywords: Any) -> Any:
        chosen = {**PARTS, **keywords}
        if num_envs is None:
            chosen.pop("max_episode_steps", None)
            env: Any = RobotEnv(randomize=randomize, **chosen)
        else:
            env = RobotVectorEnv(num_envs, randomize=randomize, **chosen)
        made.append(env)
        return env

    yield build
    for env in made:
        env.close()


@pytest.fixture
def actions() -> Callable[[int, int], Any]:
    """Return random actions, (steps, num_envs, 6)."""
    return lambda steps, num_envs: np.random.default_rng(0).uniform(-1, 1, (steps, num_envs, 6))
