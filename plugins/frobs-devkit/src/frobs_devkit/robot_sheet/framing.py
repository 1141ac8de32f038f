"""Computes camera poses that show the whole robot, and projects points into the image."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from frobs_core.description import Camera
from frobs_core.util.arrays import Floats

_FOV = 24.0  # [deg] small field of view, so that near and far parts appear equally large
_AZIMUTH = -55.0  # [deg] from the robot's x axis, for a view from the robot's front right
_ELEVATION = 17.0  # [deg]


@dataclass(frozen=True)
class View:
    """A camera view, and the size of its image."""

    pos: Floats  # camera position in the world frame, (3,) [m]
    axes: Floats  # right, up and back directions of the camera, as rows, (3, 3)
    size: tuple[int, int]  # height and width [pixels]
    scale: float  # approximate image scale [pixels/m]

    @property
    def camera(self) -> Camera:
        """The camera description for a scene."""
        target = self.pos - self.axes[2]
        x, y, z = self.pos.tolist()
        tx, ty, tz = target.tolist()
        return Camera(pos=(x, y, z), target=(tx, ty, tz), fov_y=_FOV)

    def project(self, points: Floats) -> Floats:
        """Return the image positions (n, 2) [pixels] of points (n, 3) [m], relative to the top left corner."""
        right, up, back = ((points - self.pos) @ self.axes.T).T
        height, width = self.size
        focal = 0.5 * height / math.tan(math.radians(_FOV) / 2.0)
        return np.stack([width / 2.0 - focal * right / back, height / 2.0 + focal * up / back], axis=1)


def frame(points: Floats, size: tuple[int, int], fill: tuple[float, float]) -> View:
    """Return the closest view that shows all points (n, 3) [m] in the world frame.

    The image has a size (height, width) [pixels], and the points may ``fill`` these fractions of its height and width.
    """
    azimuth, elevation = math.radians(_AZIMUTH), math.radians(_ELEVATION)
    back = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back])
    x, y, z = (points @ axes.T).T
    slope = math.tan(math.radians(_FOV) / 2.0)
    # A point is left of the right edge if x − cx ≤ k·(cz − z), right of the left edge if cx − x ≤ k·(cz − z), …
    place, distances = [], []
    for along, k in ((x, slope * size[1] / size[0] * fill[1]), (y, slope * fill[0])):
        one, other = (along + k * z).max(), (-along + k * z).max()
        place.append((one - other) / 2.0)
        distances.append((one + other) / (2.0 * k))
    least = z.max() + 0.05  # keeps the camera in front of all points, even if the points coincide
    distance = max(*distances, least)
    scale = size[0] / (2.0 * slope * (distance - float(z.mean())))
    return View(np.array([*place, distance]) @ axes, axes, size, scale)
