"""The algorithms learn a small task in a short time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

from frobs_core import plugins
from frobs_devkit.testing.algorithm.baseline_task import Aim

SETTINGS: dict[str, tuple[int, dict[str, Any]]] = {
    "rllib_ppo": (6_000, {"n_steps": 32, "batch_size": 64, "learning_rate": 3e-3, "gamma": 0.5}),
    "rllib_sac": (
        1_500,
        {"learning_rate": 3e-3, "gamma": 0.5, "gradient_steps": 2, "policy_kwargs": {"net_arch": [32]}},
    ),
    "rllib_appo": (16_000, {"n_steps": 16, "batch_size": 128, "learning_rate": 3e-3, "gamma": 0.5, "ent_coef": 0.0}),
}


class Ones(gym.Env[Any, Any]):
    """A task without an end, in which nothing changes and every step earns 1."""

    observation_space = gym.spaces.Box(0.0, 1.0, (1,), np.float32)
    action_space = gym.spaces.Discrete(2)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        return np.ones(1, np.float32), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return np.ones(1, np.float32), 1.0, False, False, {}


def train(name: str, spec: EnvSpec, steps: int, config: dict[str, Any], monitor: Any) -> Iterator[Any]:
    """Yield the algorithm after 0 and after ``steps`` steps."""
    same_step = {"autoreset_mode": AutoresetMode.SAME_STEP}
    env = gym.make_vec(spec, 8, vectorization_mode="sync", vector_kwargs=same_step)
    env.reset(seed=0)
    for number in (0, steps):
        algorithm = plugins.get_record("algorithm", name).load()(env, config, 1)
        algorithm.train(number, monitor)
        yield algorithm
    env.close()


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("name", ["rllib_ppo", "rllib_appo"])
def test_a_truncated_episode_would_have_gone_on(name: str, monitor: Any) -> None:
    spec = EnvSpec("frobs_test/Ones-v0", Ones, max_episode_steps=5)
    config = {"n_steps": 20, "batch_size": 160, "learning_rate": 1e-2, "gamma": 0.9}
    _, after = train(name, spec, 40_000, config, monitor)
    value = after.module.compute_values({"obs": th.ones(1, 1)}).item()
    assert value == pytest.approx(1.0 / (1.0 - 0.9), rel=0.1)  # about 3 if a truncation counted as an end


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("name", SETTINGS)
def test_it_learns_to_name_the_number_that_it_sees(name: str, monitor: Any) -> None:
    steps, config = SETTINGS[name]
    spec = EnvSpec("frobs_test/Aim-v0", Aim, max_episode_steps=10, kwargs={"discrete": False})
    shown = np.linspace(-1.0, 1.0, 64, dtype=np.float32)[:, None]
    before, after = (
        float(Aim(discrete=False).rewards(shown, algorithm.predict(shown)[0]).mean())
        for algorithm in train(name, spec, steps, config, monitor)
    )
    assert before < -0.3
    assert after > before + 0.2
