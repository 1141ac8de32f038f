"""Tasks get their robots by name, and tasks of version 0.2 get the first controller."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from typing import Any

import pytest

from frobs_core.contracts import Controller, Simulation
from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_core.kernel.compose import plan
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.env import RobotEnv
from frobs_core.plugins import get_record
from frobs_core.plugins.records import TaskRecord
from frobs_core.util.errors import MissingSettingError
from frobs_tasks_reach.reach import Reach
from frobs_tasks_reach.together import ReachTogether

ARMS = {"left": "irb120", "right": {"robot": "irb120", "pose": {"pos": [0.0, 2.0, 0.0]}}}


class ReachOf02(Reach):
    """A task as in version 0.2, which extends a task of this version."""

    def bind(self, simulation: Simulation, controller: Controller, control_timestep: float) -> None:  # type: ignore[override]
        self.first = controller
        super().bind(simulation, controller, control_timestep)  # type: ignore[arg-type]


class ReachOf02Again(ReachOf02):
    def bind(self, simulation: Simulation, controller: Controller, control_timestep: float) -> None:  # type: ignore[override]
        super().bind(simulation=simulation, controller=controller, control_timestep=control_timestep)


class TwoPartsOf02(ReachTogether):
    """A task as in version 0.2, which consists of tasks of this version."""

    def bind(self, simulation: Simulation, controller: Controller, control_timestep: float) -> None:  # type: ignore[override]
        self.parts = {}
        for name in simulation.robots:
            self.parts[name] = part = Reach()
            part.robot_name = name
            part.bind(simulation, controller, control_timestep)  # type: ignore[arg-type]


def reach_with(task: type, **keywords: Any) -> RobotEnv:
    record = replace(get_record("task", "reach"), entry_point=f"{__name__}:{task.__name__}")
    assert isinstance(record, TaskRecord)
    return RobotEnv(task=record, controller="joint_delta_position", **keywords)


def test_missing_robot_is_named_with_the_existing_ones() -> None:
    text = r"needs a robot named 'robot'; .* named left, right; rename one of them: robots=\{'robot': …\}"
    with pytest.raises(MissingSettingError, match=text):
        RobotEnv(task="reach", robots=ARMS, controller="joint_delta_position")


def test_stated_robot_is_missed_before_the_simulator_is_loaded() -> None:
    simulator = replace(get_record("simulator", "mujoco"), entry_point="no_such_module:Simulation")
    config = EnvConfig(task="push", robots={"left": "panda"}, controller="tcp_delta_pose", simulator=simulator)  # type: ignore[arg-type]
    with pytest.raises(MissingSettingError, match="task 'push' needs a robot named 'robot'"):
        plan(config, 1)


def test_control_returns_each_robot_by_name() -> None:
    with closing(RobotEnv(task="reach_together", robots=ARMS, controller="joint_delta_position")) as env:
        for name in ARMS:
            assert env.control.robot(name) is env.simulation.robots[name]


@pytest.mark.parametrize("task", [ReachOf02, ReachOf02Again])
def test_task_of_0_2_gets_the_first_controller(task: type) -> None:
    with pytest.warns(FrobsDeprecationWarning, match=r"'controller' of ReachOf02.*\.bind.*control\.robot\('robot'\)"):
        env = reach_with(task, robot="irb120")
    with closing(env):
        assert env.task.first is env.controller
        env.reset(seed=0)
        env.step(env.action_space.sample())


def test_parts_of_a_task_of_0_2_get_their_robots() -> None:
    with pytest.warns(FrobsDeprecationWarning, match="TwoPartsOf02"):
        env = reach_with(TwoPartsOf02, robots=ARMS)
    with closing(env):
        env.reset(seed=0)
        assert env.task.parts.keys() == ARMS.keys()
