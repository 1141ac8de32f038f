"""Conversion of a floor plan to a scene with walls, boxes, and a camera that sees the whole plan."""

from __future__ import annotations

import math

import numpy as np

from frobs_core.description import Body, Camera, Scene
from frobs_core.models import Box, Pose
from frobs_tasks_navigation import terms
from frobs_tasks_navigation.boxes import box_bodies
from frobs_tasks_navigation.floor_plan import FloorPlan, Walls

_WALL_RGBA = (0.36, 0.47, 0.60, 1.0)
_FOV = 40.0  # [deg]
# Tilt of the camera from the vertical, so that images show the sides of walls and the plan's orientation.
_TILT = math.radians(22.0)
_LEAST = 8.0  # [m] minimum width and height of the area that an image shows


def build_scene(plan: FloorPlan) -> Scene:
    """Return a scene with the walls and boxes of a floor plan and a camera."""
    return Scene(bodies={**wall_bodies(plan.walls), **box_bodies(plan.boxes)}, cameras={"overview": overview(plan)})


def wall_bodies(walls: Walls) -> dict[str, Body]:
    """Return the scene's bodies for the walls, by name."""
    bodies = {}
    for i, wall in enumerate(walls.pieces):
        (x, y), length, angle = wall.middle
        # Vary the sizes slightly, because overlapping walls of the same size would flicker in images.
        thickness = (wall.thickness or walls.thickness) - 1e-4 * (i % 10)
        height = (wall.height or walls.height) - 2e-3 * (i % 10)
        w, _, _, z = terms.quat_of(np.asarray(angle)).tolist()
        bodies[f"wall_{i}"] = Body(
            geometry=Box((length, thickness, height)),
            pose=Pose((x, y, 0.5 * height), (w, 0.0, 0.0, z)),
            rgba=_WALL_RGBA,
        )
    return bodies


def overview(plan: FloorPlan) -> Camera:
    """Return a camera that sees the whole plan in a 4 : 3 image, with the plan's longer side horizontal.

    The camera is above the plan and looks along y, or along −x if the plan is longer in y than in x.
    """
    low, high = plan.extent
    middle, size = (low + high) / 2, np.maximum(high - low, _LEAST)
    across, deep = (size[0], size[1]) if size[0] >= size[1] else (size[1], size[0])
    half = math.tan(math.radians(_FOV / 2))
    far = max(0.5 * across / (half * 4.0 / 3.0), 0.5 * deep / half) * 1.18
    back = np.array([0.0, -1.0]) if size[0] >= size[1] else np.array([1.0, 0.0])
    x, y = (middle + back * far * math.sin(_TILT)).tolist()
    return Camera(pos=(x, y, far * math.cos(_TILT)), target=(float(middle[0]), float(middle[1]), 0.0), fov_y=_FOV)
