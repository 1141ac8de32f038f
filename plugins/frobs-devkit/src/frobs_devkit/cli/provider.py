"""Draws robot sheets and the pictures of cameras for ``frobs show``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frobs_cli.providers import Provider

if TYPE_CHECKING:
    from frobs_core.description import Robot


class DevkitProvider(Provider):
    """Provider that draws robot sheets and the pictures of cameras."""

    def draw(self, robot: Robot, picture: Path) -> Path:
        from frobs_devkit.robot_sheet import draw_robot_sheet

        model = robot.read_model()
        return draw_robot_sheet(robot, model, picture)

    def draw_cameras(self, id: str, keywords: Mapping[str, Any], picture: Path) -> Path:
        from frobs_devkit.camera_sheet import draw_camera_sheet

        return draw_camera_sheet(id, keywords, picture)


PROVIDER = DevkitProvider()
