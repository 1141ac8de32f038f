"""Shapes of robots and scenes as coal's; meshes as their convex hulls, which is what the engines let touch."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np

from frobs_core.arrays import Floats
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Sphere, joined, read_mesh, scaled

_THICKNESS = 1e-4
"""[m]"""


def to_coal(geometry: Geometry) -> Any:
    """Return a shape as coal's.

    Raises:
        ModelFileError: It is a mesh that cannot be read.
    """
    match geometry:
        case Box(size):
            return coal.Box(*size)
        case Sphere(radius):
            return coal.Sphere(radius)
        case Cylinder(radius, length):
            return coal.Cylinder(radius, length)
        case Capsule(radius, length):
            return coal.Capsule(radius, length)
        case Mesh():
            return _hull(_points(geometry))


def bounding_radius(geometry: Geometry) -> float:
    """Return how far [m] a shape reaches from its own origin."""
    match geometry:
        case Box(size):
            return float(np.linalg.norm(size)) / 2
        case Sphere(radius):
            return radius
        case Cylinder(radius, length):
            return float(np.hypot(radius, length / 2))
        case Capsule(radius, length):
            return radius + length / 2
    return float(np.linalg.norm(_points(geometry), axis=1).max())


def _points(mesh: Mesh) -> Floats:
    """Return the points of a mesh, (n, 3) [m]; one that is flat gets a thickness, as a hull must have a volume."""
    points = np.unique(joined(scaled(read_mesh(mesh.path), mesh.scale)).vertices, axis=0)
    _, extents, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    for axis, extent in zip(axes, extents, strict=True):
        if extent < _THICKNESS:
            points = np.concatenate([points - 0.5 * _THICKNESS * axis, points + 0.5 * _THICKNESS * axis])
    return points


def _hull(points: Floats) -> Any:
    triangles = coal.BVHModelOBBRSS()
    triangles.beginModel(0, len(points))
    triangles.addVertices(points)
    triangles.endModel()
    triangles.buildConvexHull(True, "Qt")
    return triangles.convex
