"""Conversion of shapes to Coal shapes. As in the simulators, meshes become convex hulls or convex pieces."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np

from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from frobs_core.util.arrays import Floats
from frobs_models import convex_parts


def to_coal(geometry: Geometry) -> list[Any]:
    """Convert a geometry to Coal shapes: several shapes for a decomposed mesh, otherwise one shape.

    Raises:
        ModelFileError: A mesh cannot be read or has too many triangles to be decomposed.
        MissingDependencyError: The package that decomposes meshes is not installed.
    """
    match geometry:
        case Box(size):
            return [coal.Box(*size)]
        case Sphere(radius):
            return [coal.Sphere(radius)]
        case Cylinder(radius, length):
            return [coal.Cylinder(radius, length)]
        case Capsule(radius, length):
            return [coal.Capsule(radius, length)]
    return [_hull(points) for points in _pieces(geometry)]


def bounding_radius(geometry: Geometry) -> float:
    """Return the radius of the smallest sphere around a shape's origin that contains the shape [m]."""
    match geometry:
        case Box(size):
            return float(np.linalg.norm(size)) / 2
        case Sphere(radius):
            return radius
        case Cylinder(radius, length):
            return float(np.hypot(radius, length / 2))
        case Capsule(radius, length):
            return radius + length / 2
    return max(float(np.linalg.norm(points, axis=1).max()) for points in _pieces(geometry))


def _pieces(mesh: Mesh) -> list[Floats]:
    """Return the vertices of each convex piece of a mesh, (n, 3) [m]."""
    return [np.unique(piece.vertices, axis=0) for piece in convex_parts(mesh)]


def _hull(points: Floats) -> Any:
    triangles = coal.BVHModelOBBRSS()
    triangles.beginModel(0, len(points))
    triangles.addVertices(points)
    triangles.endModel()
    triangles.buildConvexHull(True, "Qt")
    return triangles.convex
