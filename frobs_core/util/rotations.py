"""Batched rotations, represented by scalar-first quaternions (…, 4), matrices (…, 3, 3) and angles [rad].

Leading dimensions broadcast. Row *i* of a result does not depend on the number of rows, because only elementwise
functions and sums over the last axis are used. Single vectors are computed with Python floats, which are several times
as fast as arrays and round identically.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from frobs_core.util.arrays import Floats

Number = TypeVar("Number", float, Floats)

_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def quat_multiply(first: npt.ArrayLike, second: npt.ArrayLike) -> Floats:
    """Return the rotation, (…, 4), that applies ``second``, (…, 4), and then ``first``, (…, 4)."""
    first, second = np.asarray(first, float), np.asarray(second, float)
    return joined(multiply_components(*components(first), *components(second)), first, second)


def quat_conjugate(quat_wxyz: npt.ArrayLike) -> Floats:
    """Return the inverse rotations of the unit quaternions ``quat_wxyz``, (…, 4)."""
    inverse: Floats = np.asarray(quat_wxyz, float) * _CONJUGATE
    return inverse


def quat_rotate(quat_wxyz: npt.ArrayLike, vector: npt.ArrayLike) -> Floats:
    """Return ``vector`` (…, 3) rotated by the unit quaternions ``quat_wxyz``, (…, 4)."""
    quat_wxyz, vector = np.asarray(quat_wxyz, float), np.asarray(vector, float)
    return joined(rotate_components(*components(quat_wxyz), *components(vector)), quat_wxyz, vector)


def cross(first: Floats, second: Floats) -> Floats:
    """Return the cross products ``first`` × ``second``, (…, 3), bit-identical to the much slower ``np.cross``."""
    return joined(cross_components(*components(first), *components(second)), first, second)


def cross_components(a: Number, b: Number, c: Number, p: Number, q: Number, r: Number) -> tuple[Number, Number, Number]:
    """Return the cross product of (a, b, c) and (p, q, r)."""
    return b * r - c * q, c * p - a * r, a * q - b * p


def multiply_components(
    w1: Number, x1: Number, y1: Number, z1: Number, w2: Number, x2: Number, y2: Number, z2: Number
) -> tuple[Number, Number, Number, Number]:
    """Return the product of two quaternions as w, x, y and z, (…) each."""
    return (
        w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
        w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
        w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
        w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
    )


def rotate_components(
    w: Number, x: Number, y: Number, z: Number, a: Number, b: Number, c: Number
) -> tuple[Number, Number, Number]:
    """Rotate the vector (a, b, c) by the unit quaternion (w, x, y, z), whose components have the shape (…)."""
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * p + (y * r - z * q), b + w * q + (z * p - x * r), c + w * r + (x * q - y * p)


def rpy_from_quat(quat_wxyz: npt.ArrayLike) -> tuple[float, float, float]:
    """Return roll, pitch and yaw about fixed axes [rad]. At a pitch of ±90°, the result is exact and the roll is 0.

    The yaw is computed from the rotation that remains after the roll is removed, so that roll errors near a pitch of
    ±90° cancel out.

    Args:
        quat_wxyz: (4,), of length 1.
    """
    r = matrix_from_quat(quat_wxyz).tolist()
    pitch = math.atan2(-r[2][0], math.hypot(r[0][0], r[1][0]))
    roll = math.atan2(r[2][1], r[2][2]) if abs(pitch) < 0.5 * math.pi - 1e-9 else 0.0
    sine, cosine = math.sin(roll), math.cos(roll)
    yaw = math.atan2(sine * r[0][2] - cosine * r[0][1], cosine * r[1][1] - sine * r[1][2])
    return roll, pitch, yaw


def quat_from_rpy(rpy: npt.ArrayLike) -> Floats:
    """Return quaternions (…, 4) for ``rpy``: roll, pitch and yaw (…, 3) [rad] about fixed axes.

    The rotations are Rz(yaw)·Ry(pitch)·Rx(roll).
    """
    half = 0.5 * np.asarray(rpy, float)
    cr, cp, cy = components(np.cos(half))
    sr, sp, sy = components(np.sin(half))
    quat = (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
    return joined(quat, half)


def quat_from_axis_angle(axis: npt.ArrayLike, angle: npt.ArrayLike) -> Floats:
    """Return the quaternions (…, 4) of rotations about the unit vectors ``axis`` (…, 3) by ``angle`` (…) [rad]."""
    axis, half = np.asarray(axis, float), 0.5 * np.asarray(angle, float)
    vector = np.sin(half)[..., None] * axis
    scalar = np.broadcast_to(np.cos(half)[..., None], (*vector.shape[:-1], 1))
    return np.concatenate([scalar, vector], axis=-1)


def quat_from_matrix(matrix: npt.ArrayLike) -> Floats:
    """Return the unit quaternions (…, 4), with w ≥ 0, of the rotation ``matrix`` (…, 3, 3).

    The largest of the four components is computed first (Shepperd 1978), so that no rotation loses precision.
    """
    m = np.asarray(matrix, float)
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    wx, wy, wz = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, xz, yz = m[..., 1, 0] + m[..., 0, 1], m[..., 0, 2] + m[..., 2, 0], m[..., 2, 1] + m[..., 1, 2]
    rows = np.stack(  # row i is 4·q_i·(w, x, y, z)
        [
            np.stack([1 + xx + yy + zz, wx, wy, wz], -1),
            np.stack([wx, 1 + xx - yy - zz, xy, xz], -1),
            np.stack([wy, xy, 1 - xx + yy - zz, yz], -1),
            np.stack([wz, xz, yz, 1 - xx - yy + zz], -1),
        ],
        axis=-2,
    )  # (…, 4, 4)
    best = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)[..., None, None]
    quat = np.take_along_axis(rows, best, axis=-2)[..., 0, :]
    quat = quat / np.sqrt((quat * quat).sum(-1, keepdims=True))
    upper: Floats = np.where(quat[..., :1] < 0.0, -quat, quat)
    return upper


def matrix_from_quat(quat_wxyz: npt.ArrayLike) -> Floats:
    """Return the rotation matrices (…, 3, 3) of the unit quaternions ``quat_wxyz``, (…, 4)."""
    quat_wxyz = np.asarray(quat_wxyz, float)
    w, x, y, z = components(quat_wxyz)
    entries = (
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    )  # fmt: skip
    return joined(entries, quat_wxyz).reshape(*quat_wxyz.shape[:-1], 3, 3)


def quat_difference(target: npt.ArrayLike, current: npt.ArrayLike) -> Floats:
    """Return the shortest rotations from ``current`` to ``target``, two unit quaternions (…, 4).

    Returns:
        Rotation vectors (axis times angle) in their common reference frame, (…, 3) [rad], with lengths in [0, π].
    """
    delta = quat_multiply(target, quat_conjugate(current))
    delta = np.where(delta[..., :1] < 0.0, -delta, delta)
    vector = delta[..., 1:]
    sine = np.sqrt((vector * vector).sum(-1, keepdims=True))  # of half the angle
    tiny = sine < 1e-12
    factor = np.where(tiny, 2.0, 2.0 * np.arctan2(sine, delta[..., :1]) / np.where(tiny, 1.0, sine))
    rotation: Floats = factor * vector
    return rotation


def components(vectors: Floats) -> list[Any]:
    """Return the k components of vectors (…, k): arrays (…), or Python floats if there is only one vector."""
    k = vectors.shape[-1]
    return vectors.ravel().tolist() if vectors.size == k else [vectors[..., i] for i in range(k)]


def joined(values: Sequence[Any], *vectors: Floats) -> Floats:
    """Return an array (…, k) of k ``values`` (…) that were computed from the components of ``vectors``."""
    if isinstance(values[0], float):
        shape = vectors[0].shape if vectors[0].ndim >= vectors[-1].ndim else vectors[-1].shape
        return np.array(values).reshape(*shape[:-1], len(values))
    array: Floats = np.empty((*values[0].shape, len(values)))
    for i, value in enumerate(values):
        array[..., i] = value
    return array
