"""Fast quaternions: a version of :mod:`frobs_core.rotations` only for (n, 4), scalar first, five times as fast."""

from __future__ import annotations

import numpy as np

from frobs_core.arrays import Floats

_ORDER = np.array([0, 1, 2, 3, 1, 0, 3, 2, 2, 3, 0, 1, 3, 2, 1, 0])
_SIGN = np.array([[1, -1, -1, -1], [1, 1, -1, 1], [1, 1, 1, -1], [1, -1, 1, 1]], dtype=np.float64)
"""The matrix L(q) with L(q) p = q ⊗ p has the entries ``_SIGN * q[_ORDER]``."""


def quat_multiply(first: Floats, second: Floats) -> Floats:
    """Return ``first`` ⊗ ``second``: the rotation by ``second``, then by ``first``, about the world's axes."""
    left = first.take(_ORDER, axis=1).reshape(-1, 4, 4) * _SIGN  # (n, 4, 4)
    product: Floats = np.matmul(left, second[:, :, None])[:, :, 0]
    return product


def quat_from_rotation_vector(vector: Floats) -> Floats:
    """Return the rotations about ``vector`` (n, 3), by an angle equal to its length [rad]."""
    half = 0.5 * np.sqrt((vector * vector).sum(axis=-1, keepdims=True))  # (n, 1)
    half = np.maximum(half, 1e-150)  # sin(x) / x is 1 there, and x² does not underflow to 0
    quat = np.empty((len(vector), 4))
    np.cos(half, out=quat[:, :1])
    np.multiply(vector, 0.5 * np.sin(half) / half, out=quat[:, 1:])
    return quat


def quat_between(start: Floats, end: Floats) -> Floats:
    """Return the rotation from ``start`` to ``end``, as 2 sin(angle / 2) times its axis in the world, (n, 3).

    This is the rotation vector except for its length, which is 1 % too short at half a radian. It is cheaper to
    compute, and accurate enough for feedback because both vanish together.
    """
    turn = quat_multiply(end, start * np.array([1.0, -1.0, -1.0, -1.0]))
    return np.copysign(2.0, turn[:, :1]) * turn[:, 1:]  # q and −q are the same rotation; use the shorter way
