"""Draws robot sheets for ``frobs show``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from frobs_cli.providers import Provider

if TYPE_CHECKING:
    from frobs_core.description import Robot


class DevkitProvider(Provider):
    """Provider that draws robot sheets."""

    def draw(self, robot: Robot, picture: Path) -> Path:
        """Draw a robot in its home position and at its joint limits."""
        from frobs_core.models import load_model
        from frobs_devkit.robot_sheet import draw_robot_sheet

        model = load_model(robot.model, xacro_args=robot.xacro_args, package_paths=robot.package_paths)
        return draw_robot_sheet(robot, model, picture)


PROVIDER = DevkitProvider()
