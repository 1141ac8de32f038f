"""Exact intersections of rays with round shapes. Bullet's are off by up to a centimeter at grazing angles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Floats
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Sphere

ROUND = (Sphere, Cylinder, Capsule)
"""Shapes for which Bullet's rays end some distance away from the surface."""


def distances(geometry: Geometry, origins: Floats, directions: Floats) -> Floats:
    """Return the distance at which each ray first hits a shape from outside, (k,) [m], or infinity if it misses.

    Args:
        geometry: The shape, which must not be a mesh.
        origins: (k, 3) in the shape's frame [m]
        directions: (k, 3) unit vectors.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        match geometry:
            case Box(size):
                half = np.array(size) / 2
                return _slabs(origins, directions, -half, half)
            case Sphere(radius):
                return _ball(origins, directions, radius)
            case Cylinder(radius, length):
                return _cylinder(origins, directions, radius, length)
            case Capsule(radius, length):
                ends = (np.array([0.0, 0.0, sign * length / 2]) for sign in (-1.0, 1.0))
                balls = [_ball(origins - end, directions, radius) for end in ends]
                nearest: Floats = np.minimum.reduce([_side(origins, directions, radius, length), *balls])
                return nearest
            case Mesh(path):
                raise ValueError(f"{path}: distances to meshes must be measured by Bullet")


def _slabs(origins: Floats, directions: Floats, low: Floats, high: Floats) -> Floats:
    """Intersect a box from outside: a ray hits it if it enters the last slab before leaving the first."""
    at_low, at_high = (low - origins) / directions, (high - origins) / directions
    enter = np.nanmax(np.minimum(at_low, at_high), axis=1)
    leave = np.nanmin(np.maximum(at_low, at_high), axis=1)
    inside = ((directions != 0.0) | ((origins >= low) & (origins <= high))).all(axis=1)
    return _where(inside & (enter <= leave) & (enter >= 0.0), enter)


def _ball(origins: Floats, directions: Floats, radius: float) -> Floats:
    along = (origins * directions).sum(axis=1)
    root = along**2 - (origins * origins).sum(axis=1) + radius**2
    near = -along - np.sqrt(np.maximum(root, 0.0))
    return _where((root >= 0.0) & (near >= 0.0), near)


def _side(origins: Floats, directions: Floats, radius: float, length: float) -> Floats:
    """Intersect the side of a cylinder along z."""
    a = (directions[:, :2] ** 2).sum(axis=1)
    b = (origins[:, :2] * directions[:, :2]).sum(axis=1)
    root = b**2 - a * ((origins[:, :2] ** 2).sum(axis=1) - radius**2)
    near = (-b - np.sqrt(np.maximum(root, 0.0))) / a
    height = origins[:, 2] + near * directions[:, 2]
    return _where((root >= 0.0) & (near >= 0.0) & (np.abs(height) <= length / 2), near)


def _cylinder(origins: Floats, directions: Floats, radius: float, length: float) -> Floats:
    cap = (-np.sign(directions[:, 2]) * length / 2 - origins[:, 2]) / directions[:, 2]  # the cap that faces the ray
    there = origins[:, :2] + cap[:, None] * directions[:, :2]
    lid = _where((cap >= 0.0) & ((there**2).sum(axis=1) <= radius**2), cap)
    return np.minimum(_side(origins, directions, radius, length), lid)


def _where(condition: npt.NDArray[np.bool_], values: Floats) -> Floats:
    result: Floats = np.where(condition, values, np.inf)
    return result
