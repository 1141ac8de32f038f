"""Converts a floor plan to a scene: walls and boxes as bodies, and a camera that sees everything."""

from __future__ import annotations

import math

import numpy as np

from frobs_core.interfaces import Body, Camera, Scene
from frobs_core.models import Box, Pose
from frobs_tasks_navigation import terms
from frobs_tasks_navigation.boxes import box_bodies
from frobs_tasks_navigation.floor_plan import FloorPlan, Walls

_WALL_RGBA = (0.36, 0.47, 0.60, 1.0)
_FOV = 40.0  # [deg]
_TILT = math.radians(
    22.0
)  # tilt of the camera from vertical, so that wall sides are visible and the image has a clear orientation
_LEAST = 8.0  # [m] minimum extent of an image


def build_scene(plan: FloorPlan) -> Scene:
    """Return walls, boxes and a camera."""
    return Scene(bodies={**wall_bodies(plan.walls), **box_bodies(plan.boxes)}, cameras={"overview": overview(plan)})


def wall_bodies(walls: Walls) -> dict[str, Body]:
    """Return the walls as bodies of a scene, by name."""
    bodies = {}
    for i, wall in enumerate(walls.pieces):
        (x, y), length, angle = wall.middle
        # Overlapping walls of the same thickness and height would flicker in images.
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
    """Return a camera above the plan that sees all of it in a 4 : 3 image, with the longer side horizontal.

    It looks along y, or along −x if the plan is deeper than it is wide.
    """
    low, high = plan.extent
    middle, size = (low + high) / 2, np.maximum(high - low, _LEAST)
    across, deep = (size[0], size[1]) if size[0] >= size[1] else (size[1], size[0])
    half = math.tan(math.radians(_FOV / 2))
    far = max(0.5 * across / (half * 4.0 / 3.0), 0.5 * deep / half) * 1.18
    back = np.array([0.0, -1.0]) if size[0] >= size[1] else np.array([1.0, 0.0])
    x, y = (middle + back * far * math.sin(_TILT)).tolist()
    return Camera(pos=(x, y, far * math.cos(_TILT)), target=(float(middle[0]), float(middle[1]), 0.0), fov_y=_FOV)
