"""A paced simulator, ``templates/my_paced_simulator.py``: its world is a process of its own, by the wall clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import paced_plugin
import pytest
from gymnasium.vector import AutoresetMode

from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import CapabilityError, ParameterValueError, SimulationError
from frobs_data import record
from frobs_data.recorded_features import SEED
from frobs_devkit.testing import check_env, run_checks
from frobs_train import evaluate, make_vector_env, open_pretrained

PARTS = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}
LOW, HIGH = (-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)
ID = "frobs_core:frobs/Irb120Reach-v0"
ACTION = np.array([1.0, -1.0, 1.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def env() -> Iterator[RobotEnv]:
    env = RobotEnv(**PARTS, simulator=paced_plugin.RECORD, goal_low=LOW, goal_high=HIGH)
    yield env
    env.close()


def off_home(env: RobotEnv) -> float:
    return float(np.abs(env.robot.joint_positions - env.robot.home).max())


def test_steps_follow_the_wall_clock(env: RobotEnv) -> None:
    env.reset(seed=0)
    start = time.monotonic()
    for _ in range(25):
        *_, info = env.step(np.zeros(6))
    # On a loaded machine more time may pass than was simulated, and deadlines are missed; never less time.
    assert time.monotonic() - start >= env.simulation.time[0] - 1e-3
    assert env.simulation.time[0] == pytest.approx((25 + info["frobs/missed_deadlines"]) * 0.04)


def test_a_missed_deadline_is_in_the_info(env: RobotEnv) -> None:
    env.reset(seed=0)
    before = env.step(np.zeros(6))[4]
    time.sleep(0.1)  # 0.06 s after the deadline
    after = env.step(np.zeros(6))[4]
    assert after["frobs/missed_deadlines"] - before["frobs/missed_deadlines"] >= 2
    assert after["frobs/lateness"] - before["frobs/lateness"] >= 0.059
    env.reset()
    assert env.step(np.zeros(6))[4]["frobs/missed_deadlines"] == 0.0


def test_a_reset_drives_home_and_returns_when_it_is_there(env: RobotEnv) -> None:
    env.reset(seed=0)
    for _ in range(10):
        env.step(ACTION)
    away, start = off_home(env), time.monotonic()
    assert away > 0.3
    env.reset()
    assert off_home(env) <= 0.05
    assert time.monotonic() - start >= 0.9 * away  # 1 rad/s at most
    assert env.simulation.time[0] == 0.0


def test_a_robot_that_does_not_get_home_is_an_error() -> None:
    slow = RobotEnv(
        **PARTS, simulator=paced_plugin.RECORD, simulator_kwargs={"homing_timeout": 0.1}, goal_low=LOW, goal_high=HIGH
    )
    slow.reset(seed=0)
    for _ in range(10):
        slow.step(ACTION)
    with pytest.raises(SimulationError, match=r"did not reach their home positions within 0\.1 s of a reset"):
        slow.reset()
    slow.close()


def test_what_needs_teleporting_or_a_snapshot_is_refused(env: RobotEnv) -> None:
    with pytest.raises(CapabilityError, match="task 'reach', reset with joint_positions  teleport"):
        env.reset(options={"joint_positions": np.zeros(6)})
    with pytest.raises(CapabilityError, match="snapshot"):
        env.snapshot()
    with pytest.raises(CapabilityError, match="task 'reach'  teleport"):
        RobotEnv(**PARTS, simulator=paced_plugin.RECORD, initial="random")


def test_there_is_one_environment() -> None:
    with pytest.raises(
        ParameterValueError, match=r"num_envs is 2; it must be 1, because simulator 'my_paced_simulator' is paced"
    ):
        RobotVectorEnv(2, **PARTS, simulator=paced_plugin.RECORD)


@pytest.mark.slow
def test_the_step_that_ends_an_episode_drives_home() -> None:
    env = RobotVectorEnv(1, **PARTS, simulator=paced_plugin.RECORD, max_episode_steps=10, goal_low=LOW, goal_high=HIGH)
    env.reset(seed=0)
    for _ in range(10):
        *_, truncated, info = env.step(ACTION[None])
    assert truncated.all()
    assert info["_final_obs"].all()
    assert float(np.abs(env.robot.joint_positions - env.robot.home).max()) <= 0.05
    env.close()


@pytest.mark.slow
def test_the_step_that_begins_an_episode_moves_nothing() -> None:
    env = RobotVectorEnv(
        1, **PARTS, simulator=paced_plugin.RECORD, autoreset_mode=AutoresetMode.NEXT_STEP, max_episode_steps=10,
        goal_low=LOW, goal_high=HIGH,
    )  # fmt: skip
    env.reset(seed=0)
    for _ in range(10):
        *_, truncated, _ = env.step(ACTION[None])
    assert truncated.all()
    _, reward, terminated, truncated, _ = env.step(ACTION[None])
    assert [part.any() for part in (reward, terminated, truncated)] == [False] * 3
    assert float(np.abs(env.robot.joint_positions - env.robot.home).max()) <= 0.05
    assert env.simulation.time[0] == 0.0
    env.close()


def test_a_world_that_ends_is_an_error() -> None:
    env = RobotEnv(**PARTS, simulator=paced_plugin.RECORD, goal_low=LOW, goal_high=HIGH)
    env.reset(seed=0)
    simulation: Any = env.simulation
    simulation._process.kill()
    simulation._process.wait()
    with pytest.raises(SimulationError, match="the world has ended"):
        env.step(np.zeros(6))
    env.close()
    env.close()


@pytest.mark.slow
def test_the_shipped_policy_reaches_its_goals(isolated_plugins: Callable[..., object]) -> None:
    isolated_plugins(installed=True, paced="paced_plugin")
    found = evaluate(open_pretrained("frobs/Irb120Reach-v0"), episodes=10, simulator="my_paced_simulator")
    assert found.success_rate is not None
    assert found.success_rate >= 0.8  # 0.99 of 100 where it was measured


@pytest.mark.slow
def test_episodes_are_recorded(isolated_plugins: Callable[..., object], tmp_path: Path) -> None:
    isolated_plugins(installed=True, paced="paced_plugin")
    keywords: dict[str, Any] = {"policy": "pretrained", "simulator": "my_paced_simulator", "out": tmp_path / "data"}
    record(ID, episodes=2, seed=5, **keywords)
    data = record(ID, episodes=1, append=True, **keywords)
    assert [episode.length for episode in data.episodes] == [50, 50, 50]
    assert {int(seed) for seed in data.columns([SEED])[SEED]} == {5, 6, 7}
    assert data.settings is not None
    assert data.settings["simulator"] == "my_paced_simulator"
    moved = np.diff(data.columns(["observation.state"])["observation.state"], axis=0)
    assert np.abs(moved).max() > 0.01


def test_training_and_evaluation_have_one_environment(isolated_plugins: Callable[..., object]) -> None:
    isolated_plugins(installed=True, paced="paced_plugin")
    with pytest.raises(ParameterValueError, match="num_envs is 2; it must be 1"):
        make_vector_env("frobs/Irb120Reach-v0", 2, {"simulator": "my_paced_simulator"})
    env = make_vector_env("frobs/Irb120Reach-v0", 1, {"simulator": "my_paced_simulator"})
    env.reset(seed=0)
    *_, info = env.step(np.zeros((1, 6)))
    assert info["frobs/missed_deadlines"].shape == (1,)
    env.close()


def test_the_kit_says_why_a_check_of_an_environment_is_not_applicable() -> None:
    wanted = ("same_seed_repeats", "snapshot_continues", "info_keys_have_their_prefix")
    checks = [check for check in check_env(ID, simulator=paced_plugin.RECORD) if check.name in wanted]
    found = {result.name: (result.status, result.message) for result in run_checks(checks).results}
    assert found["info_keys_have_their_prefix"][0] == "passed"
    for name in ("same_seed_repeats", "snapshot_continues"):
        assert found[name][0] == "not_applicable"
        assert "is paced" in found[name][1]
