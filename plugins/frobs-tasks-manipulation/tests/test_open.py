"""Furniture that is opened: starts, targets, success, and rest."""

from __future__ import annotations

import re
from contextlib import closing
from typing import Any

import numpy as np
import pytest

from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import ResetOptionError

TASKS = {"open_drawer": "drawer", "open_door": "door"}
"""Prop of each task."""


def vector(task: str, num_envs: int = 64, **keywords: Any) -> RobotVectorEnv:
    env = RobotVectorEnv(num_envs=num_envs, task=task, robot="panda", controller="tcp_delta_pose", **keywords)
    env.reset(seed=0)
    return env


def wait(env: RobotVectorEnv, steps: int) -> dict[str, Any]:
    """Step without an action; return the last info."""
    for _ in range(steps):
        *_, info = env.step(np.zeros((env.num_envs, env.single_action_space.shape[0])))  # type: ignore[index]
    return info


def set_joint(env: RobotVectorEnv, position: float, velocity: float = 0.0) -> None:
    task: Any = env.task
    env.simulation.robots[task.furniture].write_joint_state(np.full((env.num_envs, 1), position), velocity)


@pytest.mark.parametrize("task", TASKS)
def test_the_closed_handles_are_in_the_area_and_the_targets_vary(task: str) -> None:
    with closing(vector(task, center=[0.55, 0.05], area=0.12)) as env:
        state: Any = env.task
        assert np.abs(state.handle[:, :2] - [0.55, 0.05]).max() <= 0.06 + 1e-9
        assert state.handle[:, :2].std(axis=0).min() > 0.02
        assert state.direction[:, 1].std() > 0.05
        assert state.joint == pytest.approx(np.zeros(64), abs=1e-9)
        assert state.target.std() > 0.01
        assert (state.target - state.tolerance).min() > 0.0  # closed furniture is no success
        assert (state.target + state.tolerance).max() < env.simulation.robots[state.furniture].position_upper.max()


@pytest.mark.parametrize("simulator", ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
@pytest.mark.parametrize("task", TASKS)
def test_furniture_stays_as_it_is_when_nobody_touches_it(task: str, simulator: str) -> None:
    with closing(vector(task, 2, simulator=simulator)) as env:
        state: Any = env.task
        wait(env, 25)
        assert state.joint == pytest.approx(np.zeros(2), abs=1e-6)
        half = float(state.target[0]) / 2
        set_joint(env, half)
        wait(env, 25)
        assert state.joint == pytest.approx(np.full(2, half), abs=1e-4)


@pytest.mark.parametrize("task", TASKS)
def test_the_handle_moves_as_predicted(task: str) -> None:
    with closing(vector(task, 3)) as env:
        state: Any = env.task
        predicted = state.handle_at(state.target)
        assert np.linalg.norm(predicted - state.handle, axis=1).min() > 0.05
        env.simulation.robots[TASKS[task]].write_joint_state(state.target[:, None].copy())
        wait(env, 1)
        assert state.handle == pytest.approx(predicted, abs=1e-3)


@pytest.mark.parametrize("task", TASKS)
def test_success_is_bounded_on_both_sides_and_must_hold(task: str) -> None:
    with closing(vector(task, 1, hold_steps=3)) as env:
        state: Any = env.task
        target, tolerance = float(state.target[0]), state.tolerance
        set_joint(env, target + 0.8 * tolerance)
        assert [bool(wait(env, 1)["is_success"][0]) for _ in range(4)] == [False, False, True, True]
        for beyond in (target + 1.2 * tolerance, target - 1.2 * tolerance):
            set_joint(env, beyond)
            assert not wait(env, 4)["is_success"][0]
        state.hold_steps = 1
        set_joint(env, target, velocity=20.0 * state.max_speed)
        assert not wait(env, 1)["is_success"][0]


@pytest.mark.parametrize("task", TASKS)
def test_the_reward_grows_on_the_way_and_the_sparse_one_is_0_at_the_target(task: str) -> None:
    with closing(vector(task, 1)) as env:
        state: Any = env.task
        opened, stopped = [], []
        for share in (0.0, 0.5, 1.0):
            set_joint(env, share * float(state.target[0]))
            info = wait(env, 1)
            opened.append(info["frobs/reward/open"][0])
            stopped.append(info["frobs/reward/stop"][0])
        assert opened == pytest.approx([0.0, 0.2, 0.4], abs=0.02)
        assert stopped == pytest.approx([0.0, 0.0, 0.3], abs=0.05)
    with closing(vector(task, 1, reward_type="sparse")) as env:
        assert wait(env, 1)["frobs/reward/unachieved"][0] == -1.0
        set_joint(env, float(env.task.target[0]))  # type: ignore[attr-defined]
        assert wait(env, 1)["frobs/reward/unachieved"][0] == 0.0


@pytest.mark.parametrize("task", TASKS)
def test_snapshots_keep_the_target(task: str) -> None:
    with closing(vector(task, 2)) as env:
        state: Any = env.task
        target, saved = state.target.copy(), env.snapshot()
        env.reset(seed=9)
        assert not np.array_equal(state.target, target)
        env.restore(saved)
        assert np.array_equal(state.target, target)


def test_a_reset_takes_a_target_that_the_furniture_can_reach() -> None:
    with closing(vector("open_drawer", 2)) as env:
        env.reset(options={"target": [[0.12], [0.1]]})
        assert env.task.target.tolist() == [0.12, 0.1]  # type: ignore[attr-defined]
        for wrong, reason in (
            ([[0.1], [0.5]], "is 0.5 m"),
            ([[0.1], [0.0]], "is 0 m"),
            ([[0.2, 0.1], [0.2, 0.1]], "has the shape (2,)"),
            (0.1, "has the shape ()"),
        ):
            with pytest.raises(ResetOptionError, match=re.escape(f"'target' {reason}")):
                env.reset(options={"target": wrong})
