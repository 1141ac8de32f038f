"""Check that all moving parts of an arm are above the floor."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.rotations import matrix_from_quat
from frobs_models import bounding_box
from frobs_tasks_reach.keep_out import fixed_links

Solid = tuple[Geometry, Floats, Floats]
"""Shape, with its origin (3,) [m] and its rotation matrix (3, 3) in the link's frame."""


class FloorClearance:
    """Checks whether the collision shapes of an arm's moving links are above the floor.

    Each mesh is replaced by its bounding box. Links that are not above the floor in any of the given postures are
    ignored, such as all links of an arm that hangs below the floor.

    Args:
        robot: Handle of the robot.
        postures: Joint positions used to determine which links can be above the floor, (k, dof) [rad or m].
        margin: Minimum height of all shapes above the floor [m].
    """

    def __init__(self, robot: RobotHandle, postures: Floats, margin: float = 0.0) -> None:
        self._robot = robot
        self._margin = margin
        standing = {name for name, _, _ in fixed_links(robot.model)}
        self._solids: dict[str, list[Solid]] = {}
        for link in robot.model.links:
            if not link.collisions or link.name in standing:
                continue
            solids = [
                _solid(c.geometry, np.array(c.origin.pos), matrix_from_quat(np.array(c.origin.quat_wxyz)))
                for c in link.collisions
            ]
            if self._link_is_clear(link.name, solids, postures).any():
                self._solids[link.name] = solids

    def is_clear(self, joint_positions: Floats) -> Mask:
        """Return whether the margin above the floor is kept, (n,) bool, at joint positions (n, dof) [rad or m]."""
        clear = np.ones(len(joint_positions), bool)
        for link, solids in self._solids.items():
            clear &= self._link_is_clear(link, solids, joint_positions)
        return clear

    def _link_is_clear(self, link: str, solids: list[Solid], joint_positions: Floats) -> Mask:
        pos, quat = self._robot.frame_pose(link, joint_positions)
        w, x, y, z = quat.T
        up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1)  # (n, 3)
        clear = np.ones(len(joint_positions), bool)
        for geometry, origin, rotation in solids:
            height = pos[:, 2] + (up * origin).sum(axis=-1)
            clear &= height > depth(geometry, (up[:, :, None] * rotation).sum(axis=1)) + self._margin
        return clear


def _solid(geometry: Geometry, origin: Floats, rotation: Floats) -> Solid:
    """Replace a mesh by its bounding box, because :func:`depth` does not support meshes."""
    if not isinstance(geometry, Mesh):
        return geometry, origin, rotation
    low, high = bounding_box(geometry)
    x, y, z = (high - low).tolist()
    return Box((x, y, z)), origin + rotation @ (0.5 * (low + high)), rotation


def depth(geometry: Geometry, up: Floats) -> Floats:
    """Return how far a shape extends below its origin, (n,) [m], or 0 for a mesh.

    Args:
        geometry: The shape.
        up: Unit vectors that point up, in the shape's frame, (n, 3).
    """
    match geometry:
        case Sphere(radius):
            return np.full(len(up), radius)
        case Capsule(radius, length):
            return np.abs(up[:, 2]) * (length / 2) + radius
        case Cylinder(radius, length):
            return np.abs(up[:, 2]) * (length / 2) + np.hypot(up[:, 0], up[:, 1]) * radius
        case Box(size):
            extent: Floats = (np.abs(up) * (np.array(size) / 2)).sum(axis=-1)
            return extent
    return np.zeros(len(up))
