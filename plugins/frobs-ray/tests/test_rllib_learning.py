"""The algorithms learn a small task in a short time."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
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


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("name", SETTINGS)
def test_it_learns_to_name_the_number_that_it_sees(name: str, monitor: Any) -> None:
    steps, config = SETTINGS[name]
    spec = EnvSpec("frobs_test/Aim-v0", "frobs_devkit.testing.algorithm.baseline_task:Aim", max_episode_steps=10)
    spec.kwargs["discrete"] = False
    env = gym.make_vec(spec, 8, vectorization_mode="sync", vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP})
    env.reset(seed=0)
    algorithm = plugins.get_record("algorithm", name).load()(env, config, 1)
    shown = np.linspace(-1.0, 1.0, 64, dtype=np.float32)[:, None]
    before, after = [], []
    for rewards in (before, after):
        rewards.append(float(Aim(discrete=False).rewards(shown, algorithm.predict(shown)[0]).mean()))
        if rewards is before:
            algorithm.train(steps, monitor)
    env.close()
    assert before[0] < -0.3
    assert after[0] > before[0] + 0.2
