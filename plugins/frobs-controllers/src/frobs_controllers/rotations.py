"""Functions for scalar-first quaternion arrays (n, 4)."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import components, joined, quat_conjugate, quat_multiply


def quat_from_rotation_vector(vector: Floats) -> Floats:
    """Return quaternions (n, 4) for rotation vectors (n, 3), whose lengths are the angles [rad]."""
    x, y, z = components(vector)
    half = np.maximum(0.5 * np.sqrt(x * x + y * y + z * z), 1e-150)  # avoids 0 / 0, whose limit is 1
    factor = 0.5 * np.sin(half) / half
    return joined((np.cos(half), factor * x, factor * y, factor * z), vector)


def quat_between(start: Floats, end: Floats) -> Floats:
    """Return the rotation from ``start`` to ``end`` as 2 sin(angle / 2) times its axis in the world frame, (n, 3).

    The result has the direction of the rotation vector but is slightly shorter, by 1 % at half a radian. The result is
    cheaper to compute than the rotation vector, and it is accurate enough for feedback because both are zero when the
    orientations are equal.
    """
    turn = quat_multiply(end, quat_conjugate(start))
    return np.copysign(2.0, turn[:, :1]) * turn[:, 1:]  # q and −q represent the same rotation; use the shorter path
