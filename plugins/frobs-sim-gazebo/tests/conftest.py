"""What the tests share: a real Gazebo, by the name that these tests use."""

from __future__ import annotations

import pytest

from frobs_sim_gazebo.installation import Installation


@pytest.fixture(scope="session")
def gazebo(real_gazebo: Installation) -> Installation:
    """Return a real Gazebo 11."""
    return real_gazebo
