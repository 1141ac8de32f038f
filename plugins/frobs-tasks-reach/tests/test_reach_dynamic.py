from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError

DYNAMIC = "frobs/Irb120ReachDynamic-v0"
STILL = np.zeros((16, 6), np.float32)


def test_the_goal_moves_with_the_velocity_that_is_observed_and_stays_in_the_box(make):
    env = make(DYNAMIC, 16, max_episode_steps=1000)
    observation, _ = env.reset(seed=0)
    for _ in range(100):
        after, *_ = env.step(STILL)
        moved = (after[:, 9:12].astype(float) - observation[:, 9:12]) / 0.04
        mean_velocity = (after[:, 18:].astype(float) + observation[:, 18:]) / 2.0
        np.testing.assert_allclose(moved, mean_velocity, atol=1e-4)
        assert ((after[:, 9:12] >= [-0.5, -0.5, 0.0]) & (after[:, 9:12] <= [0.5, 0.5, 1.0])).all()
        observation = after
    assert np.abs(after[:, 18:]).max() > 0.02


def test_a_given_goal_is_where_the_motion_starts(make):
    env = make(DYNAMIC)
    observation, _ = env.reset(seed=0, options={"goal": (0.3, 0.1, 0.5)})
    np.testing.assert_allclose(observation[9:12], (0.3, 0.1, 0.5), atol=1e-6)
    observation, *_ = env.step(STILL[0])
    assert np.linalg.norm(observation[9:12] - (0.3, 0.1, 0.5)) > 1e-4


def test_the_tracking_error_is_a_reward_term(make):
    env = make(DYNAMIC)
    env.reset(seed=0)
    observation, reward, _, _, info = env.step(STILL[0])
    error = np.linalg.norm(observation[12:15].astype(float))
    np.testing.assert_allclose(-info["frobs/reward/tracking_error"], error, rtol=1e-6)
    np.testing.assert_allclose(env.unwrapped.task.tracking_error, [error], rtol=1e-6)
    assert reward == info["frobs/reward/tracking_error"] + info["frobs/reward/precision"]


def test_a_motion_too_large_for_the_box_is_refused():
    with pytest.raises(ConfigurationError, match=r"too little reachable space for a goal that oscillates by 0.45 m"):
        gym.make(DYNAMIC, max_amplitude=0.45)
