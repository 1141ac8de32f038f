"""Extreme points and bounding boxes of shapes, links and robots, computed from the model files."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from frobs_core.models import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Link,
    Mesh,
    RobotModel,
    Sphere,
    Visual,
)
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_core.util.rotations import matrix_from_quat
from frobs_models.meshes.mesh import read_mesh

Bounds: TypeAlias = tuple[Floats, Floats]
"""Bounding box: minimum and maximum corners, (3,) [m] each."""

_CHUNK = 20_000  # number of vertices processed at once, to limit memory use
_CIRCLE = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)


def _directions(count: int) -> Floats:
    """Return evenly spread unit vectors, (count + 6, 3): a Fibonacci sphere plus both directions of each axis."""
    i = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * i / count, np.pi * (1.0 + 5.0**0.5) * i
    flat = np.sqrt(1.0 - z * z)
    sphere = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    return np.concatenate([sphere, np.eye(3), -np.eye(3)])


_DIRECTIONS = _directions(200)


def shape_points(shape: Visual | Collision) -> Floats:
    """Return the extreme points of a shape, (n, 3) [m] in the link's frame, where n is at most a few hundred.

    Raises:
        ModelFileError: A mesh cannot be read.
    """
    rotation = matrix_from_quat(np.array(shape.origin.quat_wxyz))
    points = _points(shape.geometry)
    return np.asarray(np.array(shape.origin.pos) + (points[:, None, :] * rotation).sum(axis=2))


def _points(geometry: Geometry) -> Floats:
    match geometry:
        case Mesh(path, scale):
            scaled: Floats = mesh_points(path) * np.array(scale)
            return scaled
        case Box(size):
            corners = np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5])).reshape(3, -1).T
            box: Floats = corners * np.array(size)
            return box
        case Sphere(radius):
            return radius * _DIRECTIONS
        case Capsule(radius, length):
            ends = np.array([[0.0, 0.0, length / 2.0], [0.0, 0.0, -length / 2.0]])
            return np.concatenate([radius * _DIRECTIONS + end for end in ends])
        case Cylinder(radius, length):
            top = np.array([0.0, 0.0, length / 2.0])
            ring = np.stack([radius * np.cos(_CIRCLE), radius * np.sin(_CIRCLE), 0.0 * _CIRCLE], axis=1)
            return np.concatenate([ring + top, ring - top])


@lru_cache(maxsize=256)
def mesh_points(path: Path) -> Floats:
    """Return the extreme vertices of a mesh file before scaling, (n, 3)."""
    vertices = np.concatenate([part.vertices for part in read_mesh(path)])
    kept = np.zeros((0, 3))
    for start in range(0, len(vertices), _CHUNK):  # keep the farthest points among this chunk and all previous chunks
        part = np.concatenate([kept, vertices[start : start + _CHUNK]])
        kept = part[np.unique((part @ _DIRECTIONS.T).argmax(axis=0))]
    return kept


def shapes_points(shapes: Iterable[Visual | Collision]) -> Floats:
    """Return the extreme points of a link's shapes, (n, 3) [m] in the link's frame. Unreadable meshes are omitted."""
    points = [np.zeros((0, 3))]
    for shape in shapes:
        try:
            points.append(shape_points(shape))
        except ModelFileError:
            continue
    return np.concatenate(points)


def link_bounds(link: Link) -> Bounds | None:
    """Return the bounding box of a link, or None if the link has no readable shapes.

    The box encloses the collision shapes, or the visuals if the link has no readable collision shapes.
    """
    for shapes in (link.collisions, link.visuals):
        points = shapes_points(shapes)
        if len(points):
            return points.min(axis=0), points.max(axis=0)
    return None


def drawn_points(model: RobotModel, joint_positions: npt.ArrayLike) -> dict[str, Floats]:
    """Return the extreme points of a robot's visuals.

    Args:
        model: Model of the robot.
        joint_positions: (n, dof) [rad or m]

    Returns:
        Points of each link, by link name, (n, k, 3) [m] relative to the root link. A link without shapes has a single
        point at its origin.
    """
    positions = np.asarray(joint_positions, float)
    points_of = {}
    for link in model.links:
        points = shapes_points(link.visuals or link.collisions)
        if not len(points):
            points = np.zeros((1, 3))
        pos, quat = model.frame_pose(link.name, positions)
        rotation = matrix_from_quat(quat)[:, None]  # (n, 1, 3, 3)
        points_of[link.name] = pos[:, None] + (rotation * points[:, None, :]).sum(axis=-1)
    return points_of


def robot_bounds(model: RobotModel, joint_positions: npt.ArrayLike) -> Bounds:
    """Return the bounding box of a robot's visuals.

    Args:
        model: Model of the robot.
        joint_positions: (dof,) [rad or m]

    Returns:
        Minimum and maximum corners relative to the root link.
    """
    points = drawn_points(model, np.asarray(joint_positions, float)[None])
    every = np.concatenate([entry[0] for entry in points.values()])
    return every.min(axis=0), every.max(axis=0)


def lowest_points(model: RobotModel, joint_positions: npt.ArrayLike, quat_wxyz: npt.ArrayLike) -> dict[str, float]:
    """Return the height of the lowest point of each link with collision shapes [m], relative to the root link's origin.

    Args:
        model: Model of the robot.
        joint_positions: (dof,) [rad or m]
        quat_wxyz: Orientation of the root link in the world frame, (4,), scalar first.
    """
    upward = matrix_from_quat(np.asarray(quat_wxyz, float))[2]  # the world's z axis in the root's frame
    positions = np.asarray(joint_positions, float)[None]
    heights = {}
    for link in model.links:
        points = shapes_points(link.collisions)
        if len(points):
            (pos,), (quat,) = model.frame_pose(link.name, positions)
            heights[link.name] = float((upward @ pos + points @ (matrix_from_quat(quat).T @ upward)).min())
    return heights


def random_postures(model: RobotModel, count: int) -> Floats:
    """Return joint positions within the limits, at most half a turn from 0, (count, dof) [rad or m].

    Args:
        model: Model of the robot.
        count: Number of postures, which are the same in each call.
    """
    limits = [(joint.limits.lower, joint.limits.upper) for joint in model.actuated_joints]
    low, high = np.clip(np.array(limits).reshape(-1, 2), -np.pi, np.pi).T
    return np.asarray(np.random.default_rng(0).uniform(low, high, (count, len(limits))))
