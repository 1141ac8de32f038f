"""Conformance checks for a robot's description and for its behavior in each simulator."""

from __future__ import annotations

from collections.abc import Sequence

from frobs_core import plugins
from frobs_core.description import Robot
from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins.records import RobotRecord, SimulatorRecord
from frobs_devkit.testing.checks import Check, checks_of, collect
from frobs_devkit.testing.robot import description, in_simulation, sensors
from frobs_devkit.testing.robot.under_test import RobotUnderTest

DESCRIPTION_CHECKS = (*checks_of(description), sensors.sensors_are_fixed, sensors.lidars_look_around_once)
"""All robot checks that do not need a simulator."""

SIMULATION_CHECKS = (*checks_of(in_simulation), sensors.sensors_read)
"""All robot checks that run in a simulator."""


def check_robot(robot: str | Robot | RobotRecord, simulators: Sequence[str] | None = None) -> list[Check]:
    """Return the conformance checks for a robot.

    Args:
        robot: Name of an installed robot, a robot description, or the record of a robot that is not installed yet.
        simulators: Names of the simulators. Defaults to all simulators that can be imported and are not paced.

    Raises:
        UnknownNameError: The robot or a simulator does not exist.
    """
    source = plugins.get_record("robot", robot) if isinstance(robot, str) else robot
    assert isinstance(source, Robot | RobotRecord)
    checks = collect(RobotUnderTest(source), DESCRIPTION_CHECKS)
    for name in plugins.engines() if simulators is None else simulators:
        subject = RobotUnderTest(source, find_record(SimulatorRecord, name))
        checks += [check.under(name) for check in collect(subject, SIMULATION_CHECKS)]
    return checks
