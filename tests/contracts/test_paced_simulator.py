"""A paced simulator, ``templates/my_paced_simulator.py``: its world is a process of its own, by the wall clock."""

from __future__ import annotations

import importlib.util
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from frobs_core.env import RobotEnv
from frobs_core.errors import CapabilityError, ParameterValueError, SimulationError
from frobs_core.specs import SimulatorRecord
from frobs_core.vector_env import RobotVectorEnv

FILE = Path(__file__).parents[2] / "templates" / "my_paced_simulator.py"
PARTS = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}
LOW, HIGH = (-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)
ACTION = np.array([1.0, -1.0, 1.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def module() -> Iterator[ModuleType]:
    spec = importlib.util.spec_from_file_location(FILE.stem, FILE)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[FILE.stem] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    del sys.modules[FILE.stem]


@pytest.fixture(scope="module")
def record(module: ModuleType) -> SimulatorRecord:
    found = module.RECORD
    assert isinstance(found, SimulatorRecord)
    return found


@pytest.fixture(scope="module")
def env(record: SimulatorRecord) -> Iterator[RobotEnv]:
    env = RobotEnv(**PARTS, simulator=record, goal_low=LOW, goal_high=HIGH)
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


def test_a_robot_that_does_not_get_home_is_an_error(module: ModuleType, record: SimulatorRecord) -> None:
    slow = RobotEnv(**PARTS, simulator=record, simulator_kwargs={"homing_timeout": 0.1}, goal_low=LOW, goal_high=HIGH)
    slow.reset(seed=0)
    for _ in range(10):
        slow.step(ACTION)
    with pytest.raises(SimulationError, match=r"not at home 0\.1 s after a reset"):
        slow.reset()
    slow.close()


def test_what_needs_teleporting_or_a_snapshot_is_refused(env: RobotEnv, record: SimulatorRecord) -> None:
    with pytest.raises(CapabilityError, match="task 'reach', reset with joint_positions  teleport"):
        env.reset(options={"joint_positions": np.zeros(6)})
    with pytest.raises(CapabilityError, match="snapshot"):
        env.snapshot()
    with pytest.raises(CapabilityError, match="task 'reach'  teleport"):
        RobotEnv(**PARTS, simulator=record, initial="random")


def test_there_is_one_environment_and_no_reset_within_a_step(record: SimulatorRecord) -> None:
    with pytest.raises(ParameterValueError, match=r"num_envs is 2; it must be 1 on simulator 'my_paced_simulator'"):
        RobotVectorEnv(2, **PARTS, simulator=record, autoreset_mode="NextStep")
    with pytest.raises(ParameterValueError, match="it must be 'NextStep' or 'Disabled'"):
        RobotVectorEnv(1, **PARTS, simulator=record)


def test_the_step_that_begins_an_episode_moves_nothing(record: SimulatorRecord) -> None:
    env = RobotVectorEnv(
        1, **PARTS, simulator=record, autoreset_mode=AutoresetMode.NEXT_STEP, max_episode_steps=10,
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


def test_a_world_that_ends_is_an_error(record: SimulatorRecord) -> None:
    env = RobotEnv(**PARTS, simulator=record, goal_low=LOW, goal_high=HIGH)
    env.reset(seed=0)
    simulation: Any = env.simulation
    simulation._process.kill()
    simulation._process.wait()
    with pytest.raises(SimulationError, match="the world is gone"):
        env.step(np.zeros(6))
    env.close()
    env.close()
