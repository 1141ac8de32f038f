"""Copies and pickles of environments."""

from __future__ import annotations

import copy
import pickle
import sys
import threading
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import frobs_core.plugins
from frobs_core.description import Imu
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import EnvironmentCopyError, ResetNeededError
from frobs_tasks_reach.reach import Reach

ID = "frobs_core:frobs/Irb120Reach-v0"
PARTS = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}

WAYS = {
    "pickle": lambda env: pickle.loads(pickle.dumps(env)),
    "deepcopy": copy.deepcopy,
    "copy": lambda env: copy.copy(env.unwrapped),
}
ways = pytest.mark.parametrize("copied", WAYS.values(), ids=WAYS)


class Counted(RobotEnv):
    """An environment with arguments of its own."""

    def __init__(self, count: int, *, controller: str) -> None:
        super().__init__(**{**PARTS, "controller": controller})
        self.count = count


class Locked(Reach):
    """A task with an argument that can be neither copied nor pickled."""

    def __init__(self, *, lock: Any = None, **parameters: Any) -> None:
        super().__init__(**parameters)
        self.lock = lock


def rollout(env: Any, steps: int = 8) -> list[Any]:
    observation, _ = env.reset(seed=5)
    env.action_space.seed(5)
    found = [observation]
    for _ in range(steps):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        found += [observation, reward, terminated, truncated]
    return found


def assert_same(first: list[Any], second: list[Any]) -> None:
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)


@ways
@pytest.mark.parametrize(
    "build",
    [
        lambda: gym.make(ID, control_timestep=0.02, max_episode_steps=5),
        lambda: gym.make_vec(ID, num_envs=3, randomize={"gravity": {"add": {"uniform": [-0.1, 0.1]}}}),
        lambda: gym.make("frobs_core:frobs/PandaPush-v0", controller="joint_velocity"),
        lambda: RobotVectorEnv(2, max_episode_steps=4, stagger=True, **PARTS),
    ],
    ids=["single", "vector", "other controller", "staggered"],
)
def test_a_copy_repeats_the_rollout_and_leaves_the_original_alone(
    build: Callable[[], Any], copied: Callable[[Any], Any]
) -> None:
    with closing(build()) as env:
        expected = rollout(env, 3)
        before = env.unwrapped.snapshot()
        with closing(copied(env)) as other:
            assert type(other.unwrapped) is type(env.unwrapped)
            assert other.unwrapped.spec == env.unwrapped.spec
            with pytest.raises(ResetNeededError):
                other.unwrapped.step(env.action_space.sample())
            assert_same(expected, rollout(other, 3))
        after = env.unwrapped.snapshot()
        assert all((after[name] == value).all() for name, value in before.items())
        env.step(env.action_space.sample())  # closing the copy did not close the original


@ways
def test_a_closed_environment_can_be_copied(copied: Callable[[Any], Any]) -> None:
    env = RobotEnv(**PARTS)
    expected = rollout(env)
    env.close()
    with closing(copied(env)) as other:
        assert_same(expected, rollout(other))


@ways
def test_a_copy_has_the_objects_among_the_keywords(copied: Callable[[Any], Any]) -> None:
    home = {"joint_1": 0.3}
    arm = replace(frobs_core.plugins.get_record("robot", "irb120").load(), sensors={"hand": Imu(frame="link_6")})
    task = replace(frobs_core.plugins.get_record("task", "reach"), name="reach_again")
    keywords = {**PARTS, "task": task, "robot": arm, "home": home, "goal_low": np.array([0.2, -0.2, 0.2])}
    with closing(RobotEnv(**keywords)) as env:
        expected = rollout(env)
        home["joint_1"] = 0.9  # the caller's own dictionary
        with closing(copied(env)) as other:
            assert list(other.unwrapped.robot.robot.sensors) == ["hand"]
            assert_same(expected, rollout(other))


@ways
def test_a_copy_of_a_subclass_has_the_arguments_of_the_subclass(copied: Callable[[Any], Any]) -> None:
    with closing(Counted(3, controller="joint_position")) as env, closing(copied(env)) as other:
        assert other.count == 3
        assert_same(rollout(env), rollout(other))


def test_a_deep_copy_shares_what_cannot_be_copied() -> None:
    task = replace(frobs_core.plugins.get_record("task", "reach"), entry_point=f"{__name__}:Locked")
    lock = threading.Lock()
    with closing(RobotEnv(**{**PARTS, "task": task}, lock=lock)) as env, closing(copy.deepcopy(env)) as other:
        assert other.task.lock is lock
        assert_same(rollout(env), rollout(other))


@ways
def test_an_environment_of_a_paced_simulator_refuses(
    copied: Callable[[Any], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parent / "contracts")
    import paced_plugin

    with (
        closing(RobotEnv(**PARTS, simulator=paced_plugin.RECORD)) as env,
        pytest.raises(EnvironmentCopyError, match="paced, so a copy would command the same robot"),
    ):
        copied(env)
    sys.modules.pop("paced_plugin")
