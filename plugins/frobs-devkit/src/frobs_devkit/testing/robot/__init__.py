"""Checks of a robot: its description, and how it stands in each simulator."""

from __future__ import annotations

from collections.abc import Sequence

from frobs_core import plugins
from frobs_core.interfaces import Robot
from frobs_core.specs import RobotRecord, SimulatorRecord
from frobs_devkit.testing.checks import Check, checks_of, collect
from frobs_devkit.testing.robot import description, sensors, standing
from frobs_devkit.testing.robot.subject import RobotUnderTest

DESCRIPTION_CHECKS = (*checks_of(description), sensors.sensors_are_fixed, sensors.lidars_look_around_once)
"""Every check of a robot that needs no simulator."""

SIMULATION_CHECKS = (*checks_of(standing), sensors.sensors_read)
"""Every check of a robot in a simulator."""


def check_robot(robot: str | Robot | RobotRecord, simulators: Sequence[str] | None = None) -> list[Check]:
    """Return the checks of a robot.

    Args:
        robot: Its name, its description, or a record that is not installed yet.
        simulators: Those to build it in; None: all that are installed and can be imported here.

    Raises:
        UnknownNameError: No robot, or no simulator, has this name.
    """
    source = plugins.get_record("robot", robot) if isinstance(robot, str) else robot
    assert isinstance(source, Robot | RobotRecord)
    checks = collect(RobotUnderTest(source), DESCRIPTION_CHECKS)
    for name in plugins.importable("simulator") if simulators is None else simulators:
        record = plugins.get_record("simulator", name)
        assert isinstance(record, SimulatorRecord)
        checks += [check.under(name) for check in collect(RobotUnderTest(source, record), SIMULATION_CHECKS)]
    return checks
