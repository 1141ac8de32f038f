"""Places, starts, success and rewards of the manipulation tasks."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import ResetOptionError, UnknownParameterError, UnsuitableRobotError


def vector(task: str, num_envs: int = 64, **keywords: Any) -> RobotVectorEnv:
    env = RobotVectorEnv(num_envs=num_envs, task=task, robot="panda", controller="tcp_delta_pose", **keywords)
    env.reset(seed=0)
    return env


@pytest.mark.parametrize("task", ["push", "lift", "pick_and_place", "stack", "peg_insertion"])
def test_objects_and_goals_are_in_the_working_area_and_apart(task: str) -> None:
    with closing(vector(task, center=[0.45, 0.1], area=0.2)) as env:
        state: Any = env.task
        for places in (state.cube.pos, state.goal):
            assert np.abs(places[:, :2] - [0.45, 0.1]).max() <= 0.1 + 1e-9
            assert places[:, :2].std(axis=0).min() > 0.03
        if task != "lift":
            apart = np.linalg.norm((state.cube.pos - state.goal)[:, :2], axis=1)
            assert apart.min() > 2.0 * state.size


@pytest.mark.parametrize("robot", ["panda", "ur5_gripper", "irb120+two_finger_hand"])
def test_the_tool_starts_above_the_area_and_points_down(robot: str) -> None:
    place = [0.35, 0.0]
    with closing(RobotEnv(task="lift", robot=robot, controller="tcp_delta_pose", center=place)) as env:
        env.reset(seed=0)
        pos, quat = env.robot.frame_pose("tcp")
        assert pos[0] == pytest.approx([*place, 0.15], abs=2e-3)
        assert np.abs(quat[0]) == pytest.approx([0.0, 1.0, 0.0, 0.0], abs=0.02)


def test_a_reset_takes_places_of_the_cube_and_the_goal() -> None:
    cubes, goals = np.array([[0.4, 0.1, 0.02], [0.5, 0.0, 0.02]]), np.array([[0.6, 0.0, 0.2], [0.4, -0.1, 0.02]])
    with closing(vector("pick_and_place", 2)) as env:
        task: Any = env.task
        env.reset(options={"cube_position": cubes, "goal": goals})
        assert np.array_equal(task.goal, goals)
        assert task.cube.pos == pytest.approx(cubes, abs=1e-9)
        env.reset(options={"goal": goals[::-1], "reset_mask": np.array([False, True])})
        assert np.array_equal(task.goal, goals[[0, 0]])
        for option, valid, wrong in (
            ("goal", goals[0], [0.5, 0.0, -0.1]),
            ("cube_position", cubes[0], [5.0, 0.0, 0.02]),
        ):
            with pytest.raises(ResetOptionError, match=f"'{option}' is .{wrong[0]:g}, 0, {wrong[2]:g}"):
                env.reset(options={option: np.stack([valid, wrong])})


def test_half_of_the_goals_are_in_the_air() -> None:
    with closing(vector("pick_and_place", 1000)) as env:
        heights = env.task.goal[:, 2] - 0.02  # type: ignore[attr-defined]
        in_air = heights > 1e-9
        assert 0.45 < in_air.mean() < 0.55
        assert heights[in_air].min() >= 0.05
        assert heights.max() <= 0.25


def hold(env: RobotVectorEnv, pos: np.ndarray[Any, Any], steps: int) -> list[bool]:
    """Keep the cube at a place, (3,) [m]; return the success after each step."""
    found = []
    for _ in range(steps):
        env.simulation.bodies["cube"].write_pose(np.array([pos]))
        *_, info = env.step(np.zeros((1, env.single_action_space.shape[0])))  # type: ignore[index]
        found.append(bool(info["is_success"][0]))
    return found


def test_success_must_hold_for_several_steps_and_ends_when_the_cube_leaves() -> None:
    with closing(vector("push", 1, hold_steps=3, max_speed=0.5)) as env:
        goal = env.task.goal[0]  # type: ignore[attr-defined]
        assert hold(env, goal, 4) == [False, False, True, True]
        assert hold(env, goal + np.array([0.06, 0.0, 0.0]), 1) == [False]
        assert hold(env, goal, 2) == [False, False]


def test_a_cube_that_flies_past_the_goal_is_no_success() -> None:
    with closing(vector("pick_and_place", 1, hold_steps=1)) as env:
        body = env.simulation.bodies["cube"]
        body.write_pose(env.task.goal.copy())  # type: ignore[attr-defined]
        body.write_twist(np.array([[0.5, 0.0, 0.5]]), np.zeros((1, 3)))
        *_, info = env.step(np.zeros((1, env.single_action_space.shape[0])))  # type: ignore[index]
        assert env.task.to_goal[0] < 0.05  # type: ignore[attr-defined]
        assert not info["is_success"][0]


def test_a_thrown_cube_is_not_lifted() -> None:
    with closing(vector("lift", 1, hold_steps=1, max_speed=2.0)) as env:
        assert hold(env, np.array([0.6, 0.1, 0.2]), 2) == [False, False]  # in the air, and not between the fingers


def test_a_stack_counts_when_it_is_released() -> None:
    with closing(vector("stack", 1, hold_steps=1, max_speed=0.5, start_height=0.3)) as env:
        top = env.task.goal[0].copy()  # type: ignore[attr-defined]
        assert hold(env, top, 1) == [True]
        assert hold(env, top + np.array([0.0, 0.0, 0.04]), 1) == [False]  # in the air above the other cube
    with closing(vector("stack", 1, hold_steps=1, max_speed=0.5, released=0.6)) as env:
        assert hold(env, env.task.goal[0].copy(), 1) == [False]  # type: ignore[attr-defined]


def test_a_peg_counts_when_it_is_deep_in_the_hole() -> None:
    with closing(vector("peg_insertion", 1, hold_steps=1, max_speed=1.0, start_height=0.3)) as env:
        goal = env.task.goal[0].copy()  # type: ignore[attr-defined]
        assert hold(env, goal, 1) == [True]
        assert hold(env, goal + np.array([0.0, 0.0, 0.015]), 1) == [True]
        assert hold(env, goal + np.array([0.0, 0.0, 0.03]), 1) == [False]
        assert hold(env, goal + np.array([0.0, 0.15, 0.0]), 1) == [False]


@pytest.mark.parametrize("clearance", [0.002, 0.0005])
def test_the_hole_is_wider_than_the_peg_by_the_clearance(clearance: float) -> None:
    with closing(vector("peg_insertion", 2, clearance=clearance, start_height=0.3)) as env:
        task: Any = env.task
        inner = [
            shape.pose.pos[0] - np.sign(shape.pose.pos[0]) * shape.geometry.size[0] / 2
            for shape in task.scene().bodies["block"].shapes[:2]
        ]
        assert inner[1] - inner[0] == pytest.approx(task.size + clearance)
        start = task.goal + np.array([0.4 * clearance, 0.4 * clearance, 0.05])
        task.cube.body.write_pose(start, np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)))
        task.cube.body.write_twist(np.zeros((2, 3)), np.zeros((2, 3)))
        for _ in range(25):
            env.step(np.zeros((2, env.single_action_space.shape[0])))  # type: ignore[index]
        assert task.cube.pos == pytest.approx(task.goal, abs=clearance)


@pytest.mark.parametrize("task", ["push", "slide", "lift", "pick_and_place", "stack", "peg_insertion"])
def test_the_sparse_reward_is_0_where_the_condition_is_met(task: str) -> None:
    with closing(vector(task, 8, reward_type="sparse")) as env:
        *_, info = env.step(np.zeros((8, env.single_action_space.shape[0])))  # type: ignore[index]
        assert np.array_equal(info["frobs/reward/unachieved"], np.full(8, -1.0))


def test_a_robot_without_a_gripper_is_rejected() -> None:
    with pytest.raises(UnsuitableRobotError, match="has no gripper"):
        RobotEnv(task="lift", robot="ur5", controller="tcp_delta_pose")


def test_an_area_out_of_reach_is_rejected() -> None:
    with pytest.raises(UnsuitableRobotError, match=r"the reach at this height is .*; choose center=\["):
        RobotEnv(task="lift", robot="panda", controller="tcp_delta_pose", center=[1.5, 0.0])


def test_parameters_of_all_base_classes_are_accepted_and_others_are_named() -> None:
    with closing(gym.make("frobs_core:frobs/PandaPickAndPlace-v0", size=0.03, area=0.2, air_share=1.0)) as env:
        task: Any = env.unwrapped.task  # type: ignore[attr-defined]
        assert (task.size, task.area, task.air_share) == (0.03, 0.2, 1.0)
    with pytest.raises(UnknownParameterError, match="'size'"):
        gym.make("frobs_core:frobs/PandaPickAndPlace-v0", sise=0.03)


def test_snapshots_keep_how_long_success_has_held() -> None:
    with closing(vector("push", 1, hold_steps=3, max_speed=0.5)) as env:
        goal = env.task.goal[0].copy()  # type: ignore[attr-defined]
        hold(env, goal, 2)
        state = env.snapshot()
        hold(env, goal + np.array([0.1, 0.0, 0.0]), 2)
        env.restore(state)
        assert hold(env, goal, 1) == [True]
