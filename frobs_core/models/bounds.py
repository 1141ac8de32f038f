"""How large shapes, links and robots are: boxes along the axes, from the files alone."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Floats
from frobs_core.errors import ModelFileError
from frobs_core.models.model import Box, Capsule, Collision, Cylinder, Geometry, Link, Mesh, Pose, RobotModel, Visual
from frobs_core.rotations import matrix_from_quat

Bounds: TypeAlias = tuple[Floats, Floats]
"""Lowest and highest corner, (3,) [m] each."""


def geometry_bounds(geometry: Geometry, origin: Pose) -> Bounds:
    """Return the box along the axes around a shape.

    Args:
        geometry: The shape.
        origin: Where it is in the frame whose axes are meant.

    Raises:
        ModelFileError: A mesh cannot be read, or trimesh, which reads it, is not installed.
    """
    rotation = matrix_from_quat(np.array(origin.quat_wxyz))
    pos = np.array(origin.pos)
    match geometry:
        case Mesh(path, scale):
            points = mesh_points(path) * np.array(scale)
            turned = (points[:, None, :] * rotation).sum(axis=2)  # (n, 3)
            return pos + turned.min(axis=0), pos + turned.max(axis=0)
        case Box(size):
            half = np.abs(rotation) @ (np.array(size) / 2.0)
        case Cylinder(radius, length):
            along = np.abs(rotation[:, 2])
            half = radius * np.sqrt(np.maximum(0.0, 1.0 - along**2)) + along * length / 2.0
        case Capsule(radius, length):
            half = np.abs(rotation[:, 2]) * length / 2.0 + radius
        case _:
            half = np.full(3, geometry.radius)
    return pos - half, pos + half


@lru_cache(maxsize=256)
def mesh_points(path: Path) -> Floats:
    """Return the vertices of a mesh file, (n, 3) [m], unscaled.

    Raises:
        ModelFileError: It cannot be read, or trimesh, which reads it, is not installed.
    """
    try:
        import trimesh
    except ImportError as error:
        raise ModelFileError(path, "meshes are measured by trimesh; install it with 'pip install trimesh'.") from error
    try:
        scene = trimesh.load_scene(path, process=False)
        points = np.concatenate([np.asarray(mesh.vertices, float) for mesh in scene.dump() if len(mesh.vertices)])
    except Exception as error:  # each format's reader raises what it likes
        raise ModelFileError(path, f"not readable as a mesh: {' '.join(str(error).split())[:200]}.") from error
    if not len(points) or not np.isfinite(points).all():
        raise ModelFileError(path, "the mesh has no vertices, or some that are not finite.")
    return points


def shapes_bounds(shapes: Iterable[Visual | Collision]) -> Bounds | None:
    """Return the box around some shapes of a link, in its frame; None: there are none.

    Raises:
        ModelFileError: A mesh cannot be read.
    """
    return _around(geometry_bounds(shape.geometry, shape.origin) for shape in shapes)


def link_bounds(link: Link) -> Bounds | None:
    """Return the box around what a link collides with, or else what it looks like; meshes that cannot be read are left out."""
    for shapes in (link.collisions, link.visuals):
        found = []
        for shape in shapes:
            try:
                found.append(geometry_bounds(shape.geometry, shape.origin))
            except ModelFileError:
                continue
        if found:
            return _around(found)
    return None


def robot_bounds(model: RobotModel, joint_positions: npt.ArrayLike) -> Bounds:
    """Return the box around a robot, in the root link's frame; a little too large, as links' boxes are turned whole.

    Args:
        model: The robot.
        joint_positions: (n, dof) [rad or m]

    Returns:
        Lowest and highest corners, (n, 3) [m] each. A link without shapes counts as a point.
    """
    positions = np.asarray(joint_positions, float)
    low, high = np.full((len(positions), 3), np.inf), np.full((len(positions), 3), -np.inf)
    for link in model.links:
        pos, quat = model.frame_pose(link.name, positions)
        bounds = link_bounds(link) or (np.zeros(3), np.zeros(3))
        rotation = matrix_from_quat(quat)  # (n, 3, 3)
        middle = pos + (rotation * ((bounds[0] + bounds[1]) / 2.0)).sum(axis=-1)
        half = (np.abs(rotation) * ((bounds[1] - bounds[0]) / 2.0)).sum(axis=-1)
        low, high = np.minimum(low, middle - half), np.maximum(high, middle + half)
    return low, high


def _around(bounds: Iterable[Bounds]) -> Bounds | None:
    boxes = list(bounds)
    if not boxes:
        return None
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)
