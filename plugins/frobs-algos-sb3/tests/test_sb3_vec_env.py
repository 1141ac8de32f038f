from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv
from stable_baselines3.common.monitor import Monitor as SB3Monitor

from frobs_algos_sb3.vec_env import VectorEnvAdapter
from frobs_core.util.errors import ConfigurationError
from frobs_train.logs.recorder import EpisodeRecorder

KINDS = ["frobs/Irb120Reach-v0", "frobs/Irb120ReachGoal-v0", "Pendulum-v1"]


def actions(env: VectorEnvAdapter) -> np.ndarray[Any, Any]:
    return np.stack([env.action_space.sample() for _ in range(env.num_envs)])


@pytest.mark.parametrize("name", KINDS)
def test_arrays_are_those_of_the_environment(name: str, make: Any) -> None:
    adapter, plain = VectorEnvAdapter(make(name)), make(name)
    first, (expected, _) = adapter.reset(), plain.reset()
    np.testing.assert_equal(first, expected)
    for _ in range(3):
        action = actions(adapter)
        observation, rewards, dones, infos = adapter.step(action)
        expected, reward, terminated, truncated, _ = plain.step(action)
        np.testing.assert_equal(observation, expected)
        np.testing.assert_array_equal(rewards, reward.astype(np.float32))
        np.testing.assert_array_equal(dones, terminated | truncated)
        assert infos == [{}] * 4


@pytest.mark.parametrize("name", KINDS)
def test_the_end_of_an_episode_is_told_as_stable_baselines3_wants_it(name: str, make: Any) -> None:
    adapter = VectorEnvAdapter(EpisodeRecorder(make(name, 2), lambda finished: None))
    plain = make(name, 2)
    adapter.reset()
    plain.reset()
    for _ in range(200):
        action = actions(adapter)
        observation, _, dones, infos = adapter.step(action)
        expected, _, _, _, info = plain.step(action)
        if dones.any():
            break
    assert dones.all()
    np.testing.assert_equal(observation, expected)
    for index in range(2):
        np.testing.assert_equal(infos[index]["terminal_observation"], info["final_obs"][index])
        assert infos[index]["TimeLimit.truncated"] is True
        assert infos[index]["episode"]["l"] == (200 if name == "Pendulum-v1" else 50)
        if name != "Pendulum-v1":
            assert infos[index]["is_success"] == info["final_info"]["is_success"][index]
    assert adapter.step(action)[3] == [{}] * 2


def test_a_termination_is_no_time_limit(make: Any) -> None:
    adapter = VectorEnvAdapter(make("CartPole-v1", 1))
    adapter.reset()
    for _ in range(200):
        _, _, dones, infos = adapter.step(np.array([0]))
        if dones[0]:
            break
    assert infos[0]["TimeLimit.truncated"] is False


def test_rewards_may_be_written_to(make: Any) -> None:
    env = make()
    adapter = VectorEnvAdapter(env)
    adapter.reset()
    rewards = adapter.step(actions(adapter))[1]
    rewards += 1000.0
    assert adapter.step(actions(adapter))[1].max() < 500.0


def test_the_seed_of_the_environment_stays_unless_another_is_given(make: Any) -> None:
    a, b, c = (VectorEnvAdapter(make(seed=3)) for _ in range(3))
    c.seed(4)
    first = a.reset()
    np.testing.assert_array_equal(first, b.reset())
    assert not np.array_equal(first, c.reset())


def test_hindsight_replay_gets_rewards_of_a_batch_of_goals(make: Any) -> None:
    env = make("frobs/Irb120ReachGoal-v0", 3)
    adapter = VectorEnvAdapter(env)
    achieved, desired = np.random.default_rng(0).uniform(-1, 1, (2, 70, 3))
    (rewards,) = adapter.env_method("compute_reward", achieved, desired, [{}] * 70, indices=[0])
    np.testing.assert_array_equal(rewards, env.unwrapped.task.compute_reward(achieved, desired, {}))
    assert rewards.shape == (70,)


def test_single_environments_are_asked_one_by_one(make: Any) -> None:
    adapter = VectorEnvAdapter(make("Pendulum-v1", 3))
    assert adapter.get_attr("max_torque") == [2.0] * 3
    adapter.set_attr("max_torque", 1.5, indices=1)
    assert adapter.get_attr("max_torque") == [2.0, 1.5, 2.0]
    assert len(adapter.env_method("reset", seed=0, indices=[0, 2])) == 2
    assert adapter.env_is_wrapped(gym.wrappers.TimeLimit) == [True] * 3
    assert adapter.env_is_wrapped(SB3Monitor) == [False] * 3


def test_a_native_batch_is_asked_once(make: Any) -> None:
    adapter = VectorEnvAdapter(make())
    assert adapter.get_attr("control_timestep") == [0.04] * 4
    assert adapter.env_is_wrapped(SB3Monitor) == [False] * 4
    assert adapter.render_mode is None


def test_another_autoreset_is_refused() -> None:
    env = SyncVectorEnv([lambda: gym.make("Pendulum-v1")])
    with pytest.raises(ConfigurationError, match="SAME_STEP"):
        VectorEnvAdapter(env)
    env.close()
