"""Helpers of this folder."""

import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

from ros2_processes import Process, Start
from ros2_wheels import ros2_variables


@pytest.fixture
def ros2() -> Iterator[Start]:
    """Start programs that use ROS 2, and end them after the test."""
    variables = ros2_variables()
    assert variables is not None
    with ExitStack() as stack:
        yield lambda *command: stack.enter_context(Process(variables, *command))
