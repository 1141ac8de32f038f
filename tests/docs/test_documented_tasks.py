"""The task on the page about sensors passes the checks of tasks."""

import sys
from types import ModuleType
from typing import Any

import pytest
from pages import DOCS, blocks

from frobs_core.description import ForceTorque, Imu, Robot
from frobs_core.plugins.records import TaskRecord
from frobs_devkit.testing import pytest_checks
from frobs_devkit.testing.checks import collect
from frobs_devkit.testing.environment import CHECKS as OF_ENVIRONMENTS
from frobs_devkit.testing.task import CHECKS, TaskUnderTest


def feeling(sensor: Any) -> TaskUnderTest:
    """Return the task of the page on a robot with the given sensor."""
    [text] = [block.text for block in blocks(DOCS / "how-to/sensors.md") if block.attributes.get("file") == "feel.py"]
    sys.modules["feel"] = module = ModuleType("feel")
    exec(text, module.__dict__)
    arm = Robot(model="frobs_robots_abb:models/irb120.urdf.xacro", name="arm", tcp="tool0", sensors={"imu": sensor})
    record = TaskRecord(name="feel", summary="keep still", entry_point="feel:Feel")
    return TaskUnderTest("frobs/Env-v0", {"task": record, "robot": arm, "controller": "joint_position"}, record=record)


FUNCTIONS = [one for one in dict.fromkeys((*CHECKS, *OF_ENVIRONMENTS)) if one.__name__ != "fresh_process"]
"""All checks except one whose process cannot import the task."""

QUICK = ("reset_options_hold", "gymnasium_checker")

WITH_IMU = collect(feeling(Imu(frame="tool0", noise=0.01)), FUNCTIONS)
WITH_FORCE_TORQUE = collect(feeling(ForceTorque(frame="tool0", noise=0.01)), FUNCTIONS)

test_with_an_imu = pytest_checks(check for check in WITH_IMU if check.name in QUICK)
test_with_an_imu_at_length = pytest.mark.slow(pytest_checks(check for check in WITH_IMU if check.name not in QUICK))
test_with_a_force_torque_sensor = pytest_checks(check for check in WITH_FORCE_TORQUE if check.name in QUICK)
