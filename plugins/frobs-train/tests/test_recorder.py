from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from frobs_train.errors import EnvironmentFaultError
from frobs_train.logs.recorder import EpisodeRecorder, FinishedEpisodes


def record(num_envs: int, steps: int) -> tuple[list[FinishedEpisodes], Any]:
    envs = [lambda: gym.make("FrobsTests/Line-v0") for _ in range(num_envs)]
    found: list[FinishedEpisodes] = []
    env = EpisodeRecorder(SyncVectorEnv(envs, autoreset_mode=AutoresetMode.SAME_STEP), found.append)
    env.reset(seed=0)
    rewards = []
    for step in range(steps):
        _, reward, _, _, info = env.step(np.full((num_envs, 1), 0.1 * (step % 3), np.float32))
        rewards.append(reward)
    return found, (np.array(rewards), info)


def test_sums_lengths_success_and_terms_are_those_of_the_episodes() -> None:
    found, (rewards, _) = record(3, 25)
    assert [item.env_ids.tolist() for item in found] == [[0, 1, 2], [0, 1, 2]]
    for index, item in enumerate(found):
        np.testing.assert_allclose(item.rewards, rewards[10 * index : 10 * index + 10].sum(axis=0))
        np.testing.assert_allclose(item.terms["distance"] + item.terms["effort"], item.rewards)
        assert item.lengths.tolist() == [10, 10, 10]
        assert item.successes is not None
        assert set(item.successes) <= {0.0, 1.0}


def test_the_step_in_which_episodes_end_says_so_as_gymnasium_does() -> None:
    found, (_, info) = record(2, 10)
    assert info["_episode"].tolist() == [True, True]
    np.testing.assert_allclose(info["episode"]["r"], found[0].rewards)
    assert info["episode"]["l"].tolist() == [10, 10]


@pytest.mark.parametrize("value", [2.0, -1.0, "yes", np.array([True])])
def test_a_success_that_is_no_truth_value_is_an_error_of_the_environment(value: Any) -> None:
    class Vague(gym.Wrapper[Any, Any, Any, Any]):
        def step(self, action: Any) -> Any:
            *result, info = self.env.step(action)
            return (*result, {**info, "is_success": value})

    envs = SyncVectorEnv([lambda: Vague(gym.make("FrobsTests/Line-v0"))] * 2, autoreset_mode=AutoresetMode.SAME_STEP)
    env = EpisodeRecorder(envs, lambda _: None)
    env.reset(seed=0)
    still = np.zeros((2, 1), np.float32)
    with pytest.raises(EnvironmentFaultError, match="is_success is neither True nor False"):
        [env.step(still) for _ in range(10)]


def test_a_reset_begins_anew() -> None:
    found: list[FinishedEpisodes] = []
    env = EpisodeRecorder(
        SyncVectorEnv([lambda: gym.make("FrobsTests/Line-v0")], autoreset_mode=AutoresetMode.SAME_STEP), found.append
    )
    env.reset(seed=0)
    for _ in range(7):
        env.step(np.zeros((1, 1), np.float32))
    env.reset()
    for _ in range(10):
        env.step(np.zeros((1, 1), np.float32))
    assert [item.lengths.tolist() for item in found] == [[10]]
    assert env.snapshot() is None


def test_episodes_of_other_processes_are_reported_with_the_names_of_their_terms() -> None:
    found: list[FinishedEpisodes] = []
    envs = [lambda: gym.make("FrobsTests/Line-v0")]
    env = EpisodeRecorder(SyncVectorEnv(envs, autoreset_mode=AutoresetMode.SAME_STEP), found.append)
    elsewhere = FinishedEpisodes(np.array([-1]), np.array([2.0]), np.array([5]), None, {"distance": np.array([2.0])})
    env.add_elsewhere(elsewhere)
    assert found == [elsewhere]
    assert env.term_names == ("distance",)
    assert env.steps == 0
