"""Conformance checks for a controller on a suitable robot."""

from __future__ import annotations

from typing import Any

from frobs_core import plugins
from frobs_core.description import Robot
from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins.records import ControllerRecord, SimulatorRecord
from frobs_devkit.testing.checks import Check, checks_of, collect
from frobs_devkit.testing.controller import contract, motion, rest, timing
from frobs_devkit.testing.controller.under_test import ControllerUnderTest

CHECKS = checks_of(contract, motion, timing, rest)
"""All controller checks, in the order in which they run."""


def check_controller(
    controller: str | ControllerRecord, robot: str | Robot | None = None, simulator: str = "mujoco", **kwargs: Any
) -> list[Check]:
    """Return the conformance checks for a controller.

    Args:
        controller: Name of an installed controller, or the record of a controller that is not installed yet.
        robot: Name or description of the robot. Defaults to a small arm or, if it is unsuitable, a small rover.
        simulator: Name of the simulator for the checks.
        **kwargs: Keyword arguments of the controller.

    Raises:
        UnknownNameError: The controller, robot or simulator does not exist.
    """
    record = find_record(ControllerRecord, controller)
    simulator_record = find_record(SimulatorRecord, simulator)
    description = plugins.get_record("robot", robot).load() if isinstance(robot, str) else robot
    return collect(ControllerUnderTest(record, simulator_record, description, kwargs), CHECKS)
