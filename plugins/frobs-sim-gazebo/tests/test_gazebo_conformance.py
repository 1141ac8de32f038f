"""The kit's checks of a simulator, on a real Gazebo."""

from __future__ import annotations

import pytest

from frobs_devkit.testing import check_simulator, pytest_checks

test_simulator = pytest.mark.usefixtures("gazebo")(pytest_checks(check_simulator("gazebo")))
