"""Two different arms in one environment learn to reach at the same time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_train import resolve_config, train
from frobs_train.runs.policy import load_algorithm

SETTINGS = """
environment: frobs/Env-v0
environment_kwargs:
  task: reach_together
  robots:
    left: {robot: irb120, controller: tcp_delta_position, pose: {pos: [0.0, 0.8, 0.0]}}
    right: {robot: ur5, controller: tcp_delta_position, pose: {pos: [0.0, -0.8, 0.0]}}
  max_episode_steps: 100
num_envs: 64
steps: 160_000
seed: 0
evaluate_every: null
algorithm_config:
  n_steps: 16
  batch_size: 256
  n_epochs: 5
  learning_rate: lin_2e-3
  gamma: 0.9
  gae_lambda: 0.9
  policy_kwargs:
    net_arch: [64, 64]
    activation_fn: elu
    log_std_init: -0.5
"""


@pytest.mark.slow
def test_both_arms_learn_to_reach(tmp_path: Path) -> None:
    file = tmp_path / "two_arms.yaml"
    file.write_text(SETTINGS, encoding="utf-8")
    run = train(resolve_config(file=file), tmp_path / "run")
    env = RobotVectorEnv(300, **run.config.environment_kwargs, autoreset_mode="Disabled")
    policy, _ = load_algorithm(run, env.single_observation_space, env.single_action_space)
    observation, _ = env.reset(seed=1)
    for _ in range(100):
        action, _ = policy.predict(observation, None, np.zeros(300, bool), True)
        observation, _, _, truncated, _ = env.step(action)
    assert truncated.all()
    for part in env.task.parts.values():
        assert part.is_success().mean() >= 0.9
    env.close()
