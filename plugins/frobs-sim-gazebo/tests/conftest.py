"""What the tests share: the robots of the kit, and a real Gazebo, or the reason why there is none."""

from __future__ import annotations

import os

import pytest

from frobs_core.errors import SimulationError
from frobs_sim_gazebo.installation import Installation, find_gazebo


@pytest.fixture(scope="session")
def gazebo() -> Installation:
    """Return a real Gazebo 11; skip without one, and fail where FROBS_REQUIRE_GAZEBO=1 says that one must be here."""
    try:
        return find_gazebo()
    except SimulationError as error:
        if os.environ.get("FROBS_REQUIRE_GAZEBO") == "1":
            pytest.fail(f"FROBS_REQUIRE_GAZEBO=1, and {error}", pytrace=False)
        pytest.skip(str(error))
