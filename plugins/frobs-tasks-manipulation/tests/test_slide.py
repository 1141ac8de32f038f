"""A puck that slides to a goal out of reach: starts, distances, success and rewards."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import ConfigurationError, ResetOptionError


def vector(num_envs: int = 64, **keywords: Any) -> RobotVectorEnv:
    env = RobotVectorEnv(num_envs=num_envs, task="slide", robot="panda", controller="tcp_delta_pose", **keywords)
    env.reset(seed=0)
    return env


def wait(env: RobotVectorEnv, steps: int) -> dict[str, Any]:
    """Step without an action; return the last info."""
    for _ in range(steps):
        *_, info = env.step(np.zeros((env.num_envs, env.single_action_space.shape[0])))  # type: ignore[index]
    return info


def test_pucks_start_in_the_working_area_and_goals_are_in_front_of_it() -> None:
    with closing(vector(center=[0.4, 0.1], area=0.1, nearest=0.5, farthest=0.7, width=0.2)) as env:
        task: Any = env.task
        puck, goal = task.cube.pos - [0.4, 0.1, 0.015], task.goal - [1.0, 0.1, 0.015]
        assert np.abs(puck).max(axis=0) == pytest.approx([0.05, 0.05, 0.0], abs=5e-3)
        assert np.abs(goal).max(axis=0) == pytest.approx([0.1, 0.1, 0.0], abs=1e-2)
        assert task.tool.opening == pytest.approx(np.zeros(64), abs=1e-3)


@pytest.mark.parametrize("id", ["PandaSlide-v0", "Ur5Slide-v0"])
def test_the_tool_cannot_reach_the_goals(id: str) -> None:
    with closing(gym.make_vec(f"frobs_core:frobs/{id}", num_envs=64)) as env:
        env.reset(seed=0)
        vector_env: Any = env.unwrapped
        highest = vector_env.config.controller_kwargs["target_high"][0]
        assert (vector_env.task.goal[:, 0] - vector_env.task.tolerance).min() >= highest - 1e-6


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
@pytest.mark.parametrize("friction", [0.03, 0.1])
def test_a_puck_slides_as_far_as_its_friction_says(simulator: str, friction: float) -> None:
    speeds = np.array([0.3, 0.6])
    with closing(vector(2, simulator=simulator, simulator_kwargs={"cone": "elliptic"}, friction=friction)) as env:
        task: Any = env.task
        env.reset(options={"puck_position": np.array([0.6, 0.1, 0.015])})
        task.cube.body.write_twist(speeds[:, None] * [1.0, 0.0, 0.0], np.zeros((2, 3)))
        wait(env, 60)
        assert task.speed == pytest.approx(np.zeros(2), abs=1e-3)
        assert task.cube.pos[:, 0] - 0.6 == pytest.approx(speeds**2 / (2 * friction * 9.81), rel=0.1)
        assert task.cube.pos[:, 1] == pytest.approx([0.1, 0.1], abs=5e-3)


def test_a_reset_takes_places_of_the_puck_and_the_goal() -> None:
    with closing(vector(1)) as env:
        task: Any = env.task
        env.reset(options={"puck_position": [0.5, 0.05, 0.015], "goal": [0.9, -0.1, 0.015]})
        assert task.cube.pos[0] == pytest.approx([0.5, 0.05, 0.015], abs=1e-9)
        assert task.goal[0].tolist() == [0.9, -0.1, 0.015]
        with pytest.raises(ResetOptionError, match="puck_position"):
            env.reset(options={"puck_position": [0.5, 0.0, 0.0]})


def test_a_puck_that_slides_past_the_goal_is_no_success() -> None:
    with closing(vector(1, hold_steps=2)) as env:
        task: Any = env.task
        task.cube.body.write_pose(task.goal.copy())
        assert [bool(wait(env, 1)["is_success"][0]) for _ in range(2)] == [False, True]
        task.cube.body.write_twist(np.array([[0.4, 0.0, 0.0]]), np.zeros((1, 3)))
        assert not wait(env, 1)["is_success"][0]
        assert task.to_goal[0] < task.tolerance


def test_a_tool_loses_no_reward_when_the_puck_is_gone() -> None:
    with closing(vector(1)) as env:
        task: Any = env.task
        near = wait(env, 1)["frobs/reward/approach"][0]
        task.cube.body.write_pose(task.goal.copy())
        info = wait(env, 1)
        assert 0.0 < near < info["frobs/reward/approach"][0] == 0.2
        assert info["frobs/reward/slide"][0] == pytest.approx(0.8, abs=1e-3)


def test_goals_that_end_before_they_begin_are_rejected() -> None:
    with pytest.raises(ConfigurationError, match="farthest"):
        vector(1, nearest=0.5, farthest=0.4)
