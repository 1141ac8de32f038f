"""Joint states of a robot that several nodes publish."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement
from frobs_core.plugins import get_record
from frobs_ros.robot import handle
from frobs_ros.robot.handle import RosRobot


@pytest.fixture
def robot() -> RosRobot:
    description = get_record("robot", "irb120").load()
    model = description.read_model()
    made = RosRobot("robot", Placement(robot=description, model=model, command_mode=CommandMode.POSITION))
    made._began, made._heard = 0.0, {"joint states": -math.inf}
    return made


@pytest.mark.parametrize("fault", ["lost", "not finite", "no velocity"])
def test_a_robot_is_silent_if_one_of_its_nodes_stops_measuring(
    robot: RosRobot, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    now = 0.0
    monkeypatch.setattr(handle, "time", SimpleNamespace(monotonic=lambda: now))
    halves = robot.joint_names[:3], robot.joint_names[3:]

    def publish(names: tuple[str, ...], position: float, *velocity: float) -> None:
        robot._hear_joints(SimpleNamespace(name=names, position=[position] * 3, velocity=[*velocity] * 3, effort=[]))

    for now in (1.0, 2.0):
        publish(halves[0], now)
        publish(halves[1], now)
    assert robot.silent() == ("joint states", 0.0)
    for now in (3.0, 4.0):
        publish(halves[0], now)
        if fault == "not finite":
            publish(halves[1], math.nan)
        if fault == "no velocity":
            publish(halves[1], now, math.nan)
    assert robot.silent() == ("joint states", 2.0)
    robot.read()
    np.testing.assert_array_equal(robot.joint_positions[0], [4.0] * 3 + [2.0] * 3)
