"""The environment in LeRobot's format, without LeRobot; ``test_lerobot.py`` needs LeRobot."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from lerobot_env_frobs import GYM_ID
from lerobot_env_frobs.environment import LeRobotEnv, make

from frobs_core import load_policy
from frobs_core.util.errors import ConfigurationError, UnknownNameError


@pytest.fixture(scope="module", name="lift")
def lift_env() -> Iterator[LeRobotEnv]:
    with closing(make("PandaLift-v0", render_mode=None)) as env:
        yield env


def test_observations_split_the_terms_by_who_measures_them(lift: LeRobotEnv) -> None:
    observation, info = lift.reset(seed=0, options={"lerobot_new_rollout": True})
    assert lift.observation_space.contains(observation)
    assert {name: part.shape for name, part in observation.items()} == {"agent_pos": (7,), "environment_state": (18,)}
    assert info["is_success"] is False
    env: Any = lift.unwrapped
    values = env.observations.observe()[0]
    np.testing.assert_array_equal(np.concatenate(list(observation.values())), values)


def test_attributes_that_lerobot_reads(lift: LeRobotEnv) -> None:
    assert lift.get_wrapper_attr("_max_episode_steps") == 75
    assert lift.get_wrapper_attr("task") == lift.get_wrapper_attr("task_description")
    assert lift.task_description == "Pick up the cube and hold it in the air."
    assert lift.metadata["render_fps"] == 25


def test_a_control_timestep_replaces_the_rounded_rate() -> None:
    with closing(make("PandaLift-v0", fps=36, kwargs={"control_timestep": 0.028}, render_mode=None)) as env:
        assert env.unwrapped.control_timestep == 0.028  # type: ignore[attr-defined]
        assert env.metadata["render_fps"] == 36


def test_goals_belong_to_the_environment_state() -> None:
    with closing(make("frobs/PandaPickAndPlaceGoal-v0", render_mode=None)) as env:
        observation, _ = env.reset(seed=0)
        goal: Any = env.unwrapped
        *_, desired = goal.observations.terms
        key, columns = goal.observations.columns[desired]
        assert observation["environment_state"].shape == (27,)
        np.testing.assert_array_equal(
            observation["environment_state"][-3:], goal.observations.observe()[key][0, columns]
        )


@pytest.mark.parametrize("end_on_success", [True, False])
def test_success_ends_an_episode_or_counts_at_its_end(end_on_success: bool) -> None:
    def one() -> gym.Env[Any, Any]:
        return gym.make(GYM_ID, task="PandaLift-v0", end_on_success=end_on_success, render_mode=None)

    with closing(SyncVectorEnv([one], autoreset_mode=AutoresetMode.SAME_STEP)) as env:
        env.reset(seed=[0], options={"lerobot_new_rollout": True})
        expert = load_policy("expert", env.envs[0].unwrapped)
        length = 0
        ended = np.zeros(1, bool)
        while not ended.any():
            action = expert.act(None, np.array([length == 0]))
            _, _, terminated, truncated, info = env.step(action.astype(np.float32))
            ended, length = terminated | truncated, length + 1
            assert "is_success" in info or ended.any()
        assert info["final_info"]["is_success"].tolist() == [True]
        assert length < 75 if end_on_success else length == 75


def test_rate_and_length_can_be_chosen() -> None:
    with closing(make("Irb120Reach-v0", fps=50, episode_length=2, render_mode=None)) as env:
        env.reset(seed=0)
        assert env.metadata["render_fps"] == 50
        assert [env.step(env.action_space.sample())[3] for _ in range(2)] == [False, True]


@pytest.mark.needs("rendering")
def test_pictures_are_those_of_the_scene() -> None:
    with closing(make("PandaLift-v0", cameras=["overview"], image_size=(48, 64))) as env:
        observation, _ = env.reset(seed=0)
        assert env.observation_space.contains(observation)
        base: Any = env.unwrapped
        seen = base.read_terms({"eye": {"camera": "overview", "size": [48, 64]}})["eye"]
        np.testing.assert_array_equal(observation["pixels"]["overview"], seen)


def test_an_id_keeps_the_observation_terms_that_it_changes() -> None:
    with closing(make("PandaPushVision-v0", cameras=["whole"], render_mode=None)) as env:
        vision: Any = gym.make("frobs_core:frobs/PandaPushVision-v0").unwrapped
        terms: Any = env.unwrapped
        assert [*terms.observations.terms] == [*vision.observations.terms, "whole"]
        assert {*env.observation_space["pixels"]} == {"scene", "wrist", "whole"}  # type: ignore[index]
        vision.close()


def test_a_camera_that_does_not_exist_is_named() -> None:
    with pytest.raises(UnknownNameError, match=r"'desk'\. Available: overview, whole, wrist"):
        make("PandaLift-v0", cameras=["desk"])


def test_actions_that_are_not_vectors_are_rejected() -> None:
    with pytest.raises(ConfigurationError, match="requires actions that are vectors"):
        make("Irb120Reach-v0", kwargs={"controller": "discrete"}, render_mode=None)
