"""Triangles of the shapes that are drawn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import trimesh

from frobs_core.kernel.drawn import GRAY, DrawnPart, Rgba
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat
from frobs_models import MeshPart, read_mesh, scaled

_EDGE = np.radians(30.0)
"""Angle between two faces above which their common edge is drawn sharp [rad]."""

_SMOOTH = 100_000
"""Maximum number of triangles of a mesh whose edges are examined."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles of one color in one frame.

    Attributes:
        vertices: (n, 3) [m], in the frame.
        faces: Vertex indices, (m, 3).
        rgba: Color, each component in [0, 1].
    """

    vertices: Floats
    faces: npt.NDArray[np.int32]
    rgba: Rgba


def triangles(parts: Iterable[DrawnPart]) -> Iterator[Triangles]:
    """Yield the triangles of the parts of one frame, joined by color.

    Raises:
        ModelFileError: A mesh cannot be read.
    """
    by_color: dict[Rgba, list[MeshPart]] = {}
    for part in parts:
        turn, origin = matrix_from_quat(np.array(part.pose.quat_wxyz)), np.array(part.pose.pos)
        for piece in _pieces(part.geometry):
            rgba = piece.rgba or part.rgba or GRAY
            placed = MeshPart(piece.vertices @ turn.T + origin, piece.faces)
            by_color.setdefault(rgba, []).append(placed)
    for rgba, pieces in by_color.items():
        counts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
        faces = [piece.faces + count for piece, count in zip(pieces, counts, strict=False)]
        yield Triangles(
            np.concatenate([piece.vertices for piece in pieces]), np.concatenate(faces).astype(np.int32), rgba
        )


def _pieces(geometry: Geometry) -> Iterator[MeshPart]:
    match geometry:
        case Mesh():
            for part in scaled(read_mesh(geometry.path), geometry.scale):
                yield _with_edges(trimesh.Trimesh(part.vertices, part.faces, process=False), part.rgba)
        case Box(size):
            yield _with_edges(trimesh.creation.box(size))
        case Sphere(radius):
            yield _with_edges(trimesh.creation.icosphere(2, radius))
        case Cylinder(radius, length):
            yield _with_edges(trimesh.creation.cylinder(radius, length, sections=24))
        case Capsule(radius, length):
            yield _with_edges(trimesh.creation.capsule(length, radius, count=[16, 16]))


def _with_edges(mesh: Any, rgba: Rgba | None = None) -> MeshPart:
    """Return the triangles of a mesh, with separate vertices at sharp edges, so that these look sharp."""
    if len(mesh.faces) <= _SMOOTH:
        mesh = trimesh.graph.smooth_shade(mesh, angle=_EDGE)
    return MeshPart(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int32), rgba)
