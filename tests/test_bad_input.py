"""Values of a wrong type or shape are rejected by an error of FRobs that names them."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import ConfigurationError, InvalidActionError

ID = "frobs/Irb120Reach-v0"
RAGGED = [[1.0], [1.0, 2.0]]


@pytest.fixture(scope="module")
def env() -> Any:
    made = gym.make(ID).unwrapped
    yield made
    made.close()


@pytest.fixture(scope="module")
def vector() -> Any:
    made = gym.make_vec(ID, num_envs=2, vectorization_mode="vector_entry_point")
    yield made
    made.close()


@pytest.mark.parametrize("action", ["up", b"x", RAGGED, [None] * 6, ["0.1"] * 5 + ["up"], {}, [10**400] * 6])
def test_actions_that_are_no_numbers(env: Any, vector: RobotVectorEnv, action: Any) -> None:
    env.reset(seed=0)
    vector.reset(seed=0)
    with pytest.raises(InvalidActionError, match=r"the action|rows of the action"):
        env.step(action)
    with pytest.raises(InvalidActionError, match=r"the action|rows of the action"):
        vector.step([action, action])


@pytest.mark.parametrize("options", [5, "goal", [1], {5: 5}, {"goal": "far"}, {"goal": RAGGED}, {"goal": [1, "b", 2]}])
def test_reset_options(env: Any, vector: RobotVectorEnv, options: Any) -> None:
    with pytest.raises(ConfigurationError):
        env.reset(options=options)
    with pytest.raises(ConfigurationError):
        vector.reset(options=options)


@pytest.mark.parametrize("seed", [1.5, "a", [1, "a"], [1, 1.5], [1, -1], {1: 2}])
def test_seeds_of_several_environments(vector: RobotVectorEnv, seed: Any) -> None:
    with pytest.raises(ConfigurationError, match="seed is"):
        vector.reset(seed=seed)


@pytest.mark.parametrize("num_envs", [1.5, "a", None, [1], True, float("nan"), 0, 10**12])
def test_num_envs(num_envs: Any) -> None:
    with pytest.raises(ConfigurationError, match="num_envs is"):
        gym.make_vec(ID, num_envs=num_envs, vectorization_mode="vector_entry_point")


@pytest.mark.parametrize(
    "keywords",
    [
        {"robot": 5},
        {"simulator": None},
        {"num_threads": float("inf")},
        {"home": {1: 2.0}},
        {"home": {"joint_1": "a"}},
        {"controller_kwargs": {1: 2}},
        {"simulator_kwargs": {1: 2}},
        {"randomize": {1: 2}},
        {"sensors": {1: 2}},
        {"tolerance": [1, 2]},
        {"goal_low": [[1], [2]]},
        {"control_timestep": [1]},
        {"render_size": [10**9, 10**9]},
    ],
)
def test_keywords(keywords: dict[str, Any]) -> None:
    [name] = keywords
    with pytest.raises(ConfigurationError, match=name):
        gym.make(ID, **keywords)


def test_an_environment_without_a_task() -> None:
    with pytest.raises(ConfigurationError, match="needs a task; pass it as task='…'"):
        gym.make("frobs_core:frobs/Env-v0")


def test_numpy_numbers_are_numbers() -> None:
    made = gym.make_vec(
        ID, num_envs=np.int64(2), vectorization_mode="vector_entry_point", home={"joint_1": np.float64()}
    )
    made.reset(seed=[np.int64(1), None])
    made.close()
