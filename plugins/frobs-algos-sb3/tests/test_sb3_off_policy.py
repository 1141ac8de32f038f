from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.buffers import DictReplayBuffer

from frobs_algos_sb3.noise import ActionNoiseConfig, noise_state, restore_noise
from frobs_algos_sb3.recurrent_ppo import RecurrentPPO
from frobs_algos_sb3_fixtures import Family
from frobs_core.util.errors import ConfigurationError

GOAL = "frobs/Irb120ReachGoal-v0"
FAST = {"batch_size": 8, "buffer_size": 1000, "policy_kwargs": {"net_arch": [8]}}


def test_hindsight_replay_is_the_default_where_the_reward_of_another_goal_can_be_asked_for(
    family: Family, make: Any
) -> None:
    buffer = family("sac")(make(GOAL, 2), FAST, 0).model.replay_buffer
    assert isinstance(buffer, HerReplayBuffer)
    chosen = {"replay_buffer": {"n_sampled_goal": 2, "goal_selection_strategy": "final"}}
    assert family("sac")(make(GOAL, 2), FAST | chosen, 0).model.replay_buffer.n_sampled_goal == 2  # type: ignore[union-attr]
    assert (
        type(family("sac")(make(GOAL, 2), {**FAST, "replay_buffer": {"type": "standard"}}, 0).model.replay_buffer)
        is DictReplayBuffer
    )


@pytest.mark.parametrize("num_envs", [1, 3])
def test_hindsight_replay_waits_for_the_first_episodes(family: Family, num_envs: int, make: Any, monitor: Any) -> None:
    algorithm = family("sac")(make(GOAL, num_envs), {**FAST, "learning_starts": 0}, 0)
    algorithm.train(52 * num_envs, monitor)
    assert algorithm.model._n_updates == 2


@pytest.mark.parametrize(
    ("environment", "config", "message"),
    [
        ("Pendulum-v1", {"replay_buffer": {"type": "her"}}, "goal-conditioned"),
        (GOAL, {"buffer_size": 199}, "at least 2 × num_envs × max_episode_steps = 200"),
        (GOAL, {"n_steps": 3}, "n_steps is not supported for Dict observations"),
        ("Pendulum-v1", {"train_freq": {"unit": "episode"}}, "set num_envs to 1"),
        (
            "Pendulum-v1",
            {"action_noise": {"sigma": [0.1, 0.2]}},
            "sigma is .*; it must be one number, or a list of 1 numbers",
        ),
    ],
)
def test_settings_that_do_not_go_with_the_environment_are_refused(
    family: Family, environment: str, config: dict[str, Any], message: str, make: Any
) -> None:
    with pytest.raises(ConfigurationError, match=message):
        family("td3")(make(environment, 2), {**FAST, **config}, 0)


def test_whole_episodes_can_be_collected_between_rounds_of_learning(family: Family, make: Any, monitor: Any) -> None:
    config = {**FAST, "train_freq": {"frequency": 1, "unit": "episode"}, "gradient_steps": -1}
    algorithm = family("td3")(make("frobs/Irb120Reach-v0", 1), config, 0)
    algorithm.train(200, monitor)
    assert [steps for steps, _ in monitor.rows] == [50, 100, 150, 200]
    assert algorithm.model._n_updates == 100  # none in the first two: learning starts after 100 steps


def test_only_what_is_due_is_told(family: Family, make: Any, monitor: Any) -> None:
    monitor.is_due = lambda steps: steps % 40 == 0
    family("td3")(make("Pendulum-v1", 4), {**FAST, "learning_starts": 20}, 0).train(100, monitor)
    assert [steps for steps, _ in monitor.rows] == [40, 80, 100]
    assert monitor.offers == [40, 80]


def test_normal_noise_is_drawn_for_all_environments_at_once() -> None:
    noise = ActionNoiseConfig(mean=[0.0, 1.0], sigma=[0.0, 0.5]).build(2000, 2)
    drawn = noise()
    assert drawn.shape == (2000, 2)
    assert not drawn[:, 0].any()
    np.testing.assert_allclose([drawn[:, 1].mean(), drawn[:, 1].std()], [1.0, 0.5], atol=0.05)
    assert noise_state(noise) is None


@pytest.mark.parametrize("num_envs", [1, 3])
def test_wandering_noise_goes_on_from_its_state(num_envs: int) -> None:
    noise = ActionNoiseConfig(type="ornstein_uhlenbeck").build(num_envs, 2)
    for _ in range(5):
        noise()
    state = noise_state(noise)
    assert state is not None
    np.random.seed(1)  # noqa: NPY002  # SB3 draws from it
    expected = noise()
    noise.reset()
    restore_noise(noise, state)
    np.random.seed(1)  # noqa: NPY002
    np.testing.assert_array_equal(noise(), expected)


def test_dqn_tells_how_much_it_explores(family: Family, make: Any, monitor: Any) -> None:
    config = {
        **FAST,
        "policy_kwargs": {"net_arch": [8, 8]},
        "learning_starts": 10,
        "exploration_fraction": 0.5,
        "exploration_final_eps": 0.1,
    }
    family("dqn")(make("CartPole-v1", 1), config, 0).train(100, monitor)
    told = [metrics[f"{family.prefix}dqn/exploration_rate"] for _, metrics in monitor.rows]
    assert told[0] == pytest.approx(1.0 - 0.9 * 4 / 50)
    assert told[-1] == 0.1


def test_recurrent_predictions_take_a_state_and_forget_it_where_an_episode_starts(make: Any) -> None:
    env = make("Pendulum-v1", 2)
    algorithm = RecurrentPPO(env, {"n_steps": 8, "batch_size": 8}, 0)
    observation = np.stack([env.single_observation_space.sample() for _ in range(2)])
    fresh, state = algorithm.predict(observation, None, np.ones(2, bool))
    assert state is not None
    later, _ = algorithm.predict(observation, state, np.array([True, False]))
    np.testing.assert_allclose(later[0], fresh[0], atol=1e-6)
    assert not np.allclose(later[1], fresh[1])


def test_more_or_fewer_environments_than_in_the_training_are_refused(family: Family, make: Any, tmp_path: Any) -> None:
    family("td3")(make("Pendulum-v1", 2), FAST, 0).save(tmp_path)
    with pytest.raises(ConfigurationError, match="with num_envs 2, but the environment has 3"):
        family("td3").load(tmp_path, make("Pendulum-v1", 3))


def test_a_policy_that_only_predicts_needs_no_replay_buffer(family: Family, make: Any, tmp_path: Any) -> None:
    family("sac")(make(GOAL, 2), FAST, 0).save(tmp_path)
    loaded = family("sac").load(tmp_path)
    assert loaded.model.replay_buffer.buffer_size == 1  # type: ignore[union-attr]
    assert isinstance(loaded.observation_space, gym.spaces.Dict)
