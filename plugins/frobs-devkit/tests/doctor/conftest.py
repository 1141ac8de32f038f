"""Examining tiny robots."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from frobs_devkit.doctor import RobotReport, examine_robot

sys.path.insert(0, str(Path(__file__).parent))  # for tiny_robots.py

from tiny_robots import robot


@pytest.fixture
def examine(tmp_path: Path) -> Callable[..., RobotReport]:
    """Write a robot's file and examine it."""

    def run(*parts: str, simulators: tuple[str, ...] = ("mujoco",)) -> RobotReport:
        (tmp_path / "tiny.urdf").write_text(robot(*parts))
        return examine_robot(tmp_path / "tiny.urdf", simulators=simulators)

    return run
