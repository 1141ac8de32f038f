"""The kit's checks of a simulator, on a real Gazebo."""

from __future__ import annotations

import pytest

from frobs_devkit.testing import check_simulator, pytest_checks

QUICK = (
    "contacts_are_told",
    "drives_follow_positions",
    "gravity_shows",
    "lidars_measure",
)
"""Checks of the quick tests: contacts, drives, dynamics and sensors."""

CHECKS = check_simulator("gazebo")

test_simulator = pytest.mark.usefixtures("gazebo")(pytest_checks(check for check in CHECKS if check.name in QUICK))
test_simulator_in_full = pytest.mark.usefixtures("gazebo")(
    pytest.mark.slow(pytest_checks(check for check in CHECKS if check.name not in QUICK))
)


def test_the_quick_checks_exist() -> None:
    assert set(QUICK) <= {check.name for check in CHECKS}
