"""The three wrappers on an environment of ours, in the order in which FRobs_RL's scripts use them."""

import gymnasium as gym
import numpy as np
import pytest

from frobs_rl_compat.wrappers import NormalizeActionWrapper, NormalizeObservationWrapper, TimeLimitWrapper

pytest.importorskip("mujoco")


@pytest.mark.parametrize("name", ["Irb120Reach-v0", "Irb120ReachLegacy-v0"])
def test_all_three_work_on_an_arm(name):
    env = gym.make(f"frobs_core:frobs/{name}")
    inner_space = env.observation_space
    env = TimeLimitWrapper(NormalizeObservationWrapper(NormalizeActionWrapper(env)), max_steps=10)
    try:
        env.action_space.seed(0)
        observation, _ = env.reset(seed=0)
        assert observation in env.observation_space
        for step in range(10):
            observation, _, terminated, truncated, info = env.step(env.action_space.sample())
            assert observation in env.observation_space
            assert not terminated
            assert truncated == (step == 9)
        assert info["time_limit_reached"] is True
        assert info["is_success"] in (0.0, 1.0)
        assert env.unwrapped.observation_space == inner_space
        assert np.all(env.action_space.high == 1.0)
    finally:
        env.close()
