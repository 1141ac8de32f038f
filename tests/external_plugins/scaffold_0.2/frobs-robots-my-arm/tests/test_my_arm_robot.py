"""Tests of the robot: the conformance checks and your own tests."""

from frobs_devkit.testing import check_plugin, check_robot, pytest_checks

test_plugin = pytest_checks(check_plugin("robots_my_arm"))

test_robot = pytest_checks(check_robot("my_arm", simulators=["mujoco"]))
