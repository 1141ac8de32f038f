"""Rigid transforms as tuples (faster than small arrays), with quaternions in Bullet's order (x, y, z, w)."""

from __future__ import annotations

from typing import TypeAlias

from frobs_core.models import Pose
from frobs_core.util import rotations
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import cross_components, multiply_components, rotate_components

Vector: TypeAlias = tuple[float, float, float]
Quat: TypeAlias = tuple[float, float, float, float]

IDENTITY: tuple[Vector, Quat] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def from_pose(pose: Pose) -> tuple[Vector, Quat]:
    """Convert a FRobs pose to a position and a quat_xyzw."""
    w, x, y, z = pose.quat_wxyz
    return tuple(map(float, pose.pos)), (float(x), float(y), float(z), float(w))  # type: ignore[return-value]


def from_array(pose: Floats) -> tuple[Vector, Quat]:
    """Convert a pose (7,) of position and quat_wxyz to a position and a quat_xyzw."""
    px, py, pz, w, x, y, z = pose.tolist()
    return (px, py, pz), (x, y, z, w)


def multiply(first: Quat, second: Quat) -> Quat:
    """Return the rotation that applies ``second`` and then ``first``, as a quat_xyzw."""
    x1, y1, z1, w1 = first
    x2, y2, z2, w2 = second
    w, x, y, z = multiply_components(w1, x1, y1, z1, w2, x2, y2, z2)
    return x, y, z, w


def cross(a: Vector, b: Vector) -> Vector:
    """Return a × b."""
    return cross_components(*a, *b)


def rotate(quat: Quat, vector: Vector) -> Vector:
    """Rotate a vector by a quat_xyzw."""
    x, y, z, w = quat
    return rotate_components(w, x, y, z, *vector)


def conjugate(quat: Quat) -> Quat:
    """Return the inverse of a rotation, as a quat_xyzw."""
    x, y, z, w = quat
    return -x, -y, -z, w


def compose(outer: tuple[Vector, Quat], inner: tuple[Vector, Quat]) -> tuple[Vector, Quat]:
    """Return the transform that applies ``inner`` and then ``outer``."""
    (px, py, pz), quat = outer
    x, y, z = rotate(quat, inner[0])
    return (px + x, py + y, pz + z), multiply(quat, inner[1])


def invert(transform: tuple[Vector, Quat]) -> tuple[Vector, Quat]:
    """Return the inverse transform."""
    back = conjugate(transform[1])
    x, y, z = rotate(back, transform[0])
    return (-x, -y, -z), back


def rpy_from_quat(quat: Quat) -> Vector:
    """Convert a quat_xyzw to roll, pitch and yaw about fixed axes [rad]."""
    x, y, z, w = quat
    return rotations.rpy_from_quat((w, x, y, z))
