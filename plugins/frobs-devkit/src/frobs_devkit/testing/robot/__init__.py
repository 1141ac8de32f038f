"""Checks of a robot: its description, and its behavior in each simulator."""

from __future__ import annotations

from collections.abc import Sequence

from frobs_core import plugins
from frobs_core.interfaces import Robot
from frobs_core.specs import RobotRecord, SimulatorRecord
from frobs_devkit.testing.checks import Check, checks_of, collect
from frobs_devkit.testing.robot import description, sensors, standing
from frobs_devkit.testing.robot.subject import RobotUnderTest

DESCRIPTION_CHECKS = (*checks_of(description), sensors.sensors_are_fixed, sensors.lidars_look_around_once)
"""All checks of a robot that do not need a simulator."""

SIMULATION_CHECKS = (*checks_of(standing), sensors.sensors_read)
"""All checks of a robot in a simulator."""


def check_robot(robot: str | Robot | RobotRecord, simulators: Sequence[str] | None = None) -> list[Check]:
    """Return the checks of a robot.

    Args:
        robot: Name of the robot, a description, or a record that is not installed yet.
        simulators: Simulators to build it in; None: all that can be imported.

    Raises:
        UnknownNameError: The robot or a simulator does not exist.
    """
    source = plugins.get_record("robot", robot) if isinstance(robot, str) else robot
    assert isinstance(source, Robot | RobotRecord)
    checks = collect(RobotUnderTest(source), DESCRIPTION_CHECKS)
    for name in plugins.importable("simulator") if simulators is None else simulators:
        record = plugins.get_record("simulator", name)
        assert isinstance(record, SimulatorRecord)
        checks += [check.under(name) for check in collect(RobotUnderTest(source, record), SIMULATION_CHECKS)]
    return checks
