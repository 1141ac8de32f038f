"""Checks of a robot: its description, and how it stands in each simulator."""

from __future__ import annotations

from collections.abc import Sequence

from frobs_core import plugins
from frobs_core.interfaces import Robot
from frobs_core.specs import SimulatorRecord
from frobs_devkit.testing.checks import Check, checks_of, collect
from frobs_devkit.testing.robot import description, sensors, standing
from frobs_devkit.testing.robot.subject import RobotUnderTest

DESCRIPTION_CHECKS = (*checks_of(description), sensors.sensors_are_fixed)
"""Every check of a robot that needs no simulator."""

SIMULATION_CHECKS = (*checks_of(standing), sensors.sensors_read)
"""Every check of a robot in a simulator."""


def check_robot(robot: str | Robot, simulators: Sequence[str] | None = None) -> list[Check]:
    """Return the checks of a robot.

    Args:
        robot: Its name, or its description.
        simulators: Those to build it in; None: all that are installed and can be imported here.

    Raises:
        UnknownNameError: No robot, or no simulator, has this name.
    """
    the_robot = plugins.get_record("robot", robot).load() if isinstance(robot, str) else robot
    checks = collect(RobotUnderTest(the_robot), DESCRIPTION_CHECKS)
    for name in plugins.importable("simulator") if simulators is None else simulators:
        record = plugins.get_record("simulator", name)
        assert isinstance(record, SimulatorRecord)
        checks += collect(RobotUnderTest(the_robot, record), SIMULATION_CHECKS, prefix=name)
    return checks
