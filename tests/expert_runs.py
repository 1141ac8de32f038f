"""Runs of the scripted experts, shared by tests of the manipulation tasks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core import load_policy
from frobs_core.kernel.vector_env import RobotVectorEnv


@contextmanager
def made(id: str, **keywords: Any) -> Iterator[RobotVectorEnv]:
    with closing(gym.make_vec(id, **keywords)) as env:
        assert isinstance(env.unwrapped, RobotVectorEnv)
        yield env.unwrapped


def expert_of(env: RobotVectorEnv) -> Any:
    return load_policy("expert", env)


def success_rate(env: RobotVectorEnv) -> float:
    """Return the success of the expert in one episode of each environment."""
    expert = expert_of(env)
    env.reset(seed=0)
    start = np.ones(env.num_envs, bool)
    ended = False
    while not ended:
        *_, truncated, info = env.step(expert.act(None, start))
        start = np.zeros(env.num_envs, bool)
        ended = bool(truncated.all())
    return float(info["final_info"]["is_success"].mean())
