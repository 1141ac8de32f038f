"""Space that a robot's base occupies and that the tool therefore cannot reach."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.models import Box, Capsule, Cylinder, Geometry, JointType, Pose, RobotModel, Sphere
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.rotations import matrix_from_quat

Solid = tuple[Geometry, Floats, Floats]
"""Shape, with its origin (3,) [m] and its rotation matrix (3, 3) in the world frame."""


class Foot:
    """Collision shapes of a robot's root link and the links fixed to the root link, at their poses in the scene.

    Meshes are ignored. For a robot with a movable base, all shapes are ignored.

    Args:
        robot: Handle of the robot.
    """

    def __init__(self, robot: RobotHandle) -> None:
        self._solids: list[Solid] = []
        if robot.robot.base != "fixed":
            return
        base_pos, base_quat = robot.base_pose[0][0], robot.base_pose[1][0]
        rotation = matrix_from_quat(base_quat)
        for link, pos, turn in fixed_links(robot.model):
            for collision in next(each for each in robot.model.links if each.name == link).collisions:
                offset, local = _matrix(collision.origin)
                self._solids.append(
                    (collision.geometry, base_pos + rotation @ (pos + turn @ offset), rotation @ turn @ local)
                )

    def is_clear(self, positions: Floats, clearance: float) -> Mask:
        """Return whether positions (..., 3) [m] are farther than ``clearance`` [m] from all shapes, (...) bool."""
        clear = np.ones(positions.shape[:-1], bool)
        for geometry, origin, rotation in self._solids:
            local = ((positions - origin)[..., None] * rotation).sum(axis=-2)  # rotationᵀ · (p − origin)
            clear &= distance_to(geometry, local) > clearance
        return clear


def distance_to(geometry: Geometry, positions: Floats) -> Floats:
    """Return the distances between positions and a shape: 0 inside the shape, and infinite for a mesh.

    Args:
        geometry: The shape.
        positions: Positions in the shape's frame, (..., 3) [m].

    Returns:
        The distances, (...) [m].
    """
    x, y, z = positions[..., 0], positions[..., 1], positions[..., 2]
    radial = np.hypot(x, y)
    match geometry:
        case Sphere(radius):
            return np.maximum(np.hypot(radial, z) - radius, 0.0)
        case Capsule(radius, length):
            return np.maximum(np.hypot(radial, np.maximum(np.abs(z) - length / 2, 0.0)) - radius, 0.0)
        case Cylinder(radius, length):
            return np.hypot(np.maximum(radial - radius, 0.0), np.maximum(np.abs(z) - length / 2, 0.0))
        case Box(size):
            outside = [np.maximum(np.abs(c) - edge / 2, 0.0) for c, edge in zip((x, y, z), size, strict=True)]
            return np.hypot(np.hypot(outside[0], outside[1]), outside[2])
    return np.full(positions.shape[:-1], np.inf)


def fixed_links(model: RobotModel) -> list[tuple[str, Floats, Floats]]:
    """Return (name, origin (3,), rotation (3, 3)) of the root link and all links fixed to it, in the root's frame."""
    links = [(model.root, np.zeros(3), np.eye(3))]
    for name, pos, turn in links:  # the list grows while it is iterated
        for joint in model.joints:
            if joint.parent == name and joint.type is JointType.FIXED:
                offset, local = _matrix(joint.origin)
                links.append((joint.child, pos + turn @ offset, turn @ local))
    return links


def _matrix(pose: Pose) -> tuple[Floats, Floats]:
    return np.array(pose.pos), matrix_from_quat(pose.quat_wxyz)
