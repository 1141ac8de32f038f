"""The fixtures of the tests with a real ROS."""

from pathlib import Path

import pytest
from ros_graph import ignore_warnings_of_rospy


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Pass over rospy's own warnings."""
    ignore_warnings_of_rospy(items, Path(__file__).parent)


@pytest.fixture(scope="module", autouse=True)
def graph_is_left_clean(rubbish: None) -> None:
    """Remove what the tests of each module leave in the ROS graph."""
