"""Converts between ``geometry_msgs`` messages and pose arrays (7,), which contain a position [m] and quat_wxyz."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_conjugate, quat_from_rpy, quat_rotate
from frobs_rl_compat.moveit.errors import MoveItCommanderException

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def from_message(pose: Any) -> Floats:
    """Convert a ``geometry_msgs/Pose`` to an array. A zero quaternion, the message's default, means no rotation."""
    p, q = pose.position, pose.orientation
    return _checked([p.x, p.y, p.z, q.w, q.x, q.y, q.z])


def _checked(numbers: Sequence[float]) -> Floats:
    array = np.array(numbers, float)
    if not array[3:].any():
        array[3] = 1.0
    length = float(np.linalg.norm(array[3:]))
    if not np.isfinite(array).all() or abs(length - 1.0) > 0.01:
        raise MoveItCommanderException(
            f"the pose has the position {array[:3].tolist()} and the quaternion {array[[4, 5, 6, 3]].tolist()} (x, y, "
            "z, w); all numbers must be finite, and the quaternion must have unit length."
        )
    array[3:] /= length
    return array


def to_message(array: Floats) -> Any:
    """Convert a pose array to ``geometry_msgs/Pose``."""
    from geometry_msgs.msg import Point, Pose, Quaternion

    x, y, z, w, i, j, k = array.tolist()
    return Pose(Point(x, y, z), Quaternion(i, j, k, w))


def from_list(numbers: Sequence[float]) -> Floats:
    """Convert a list to a pose array. It contains x, y, z and either roll, pitch, yaw or a quaternion x, y, z, w."""
    values = [float(number) for number in numbers]
    if len(values) == 6:
        return _checked([*values[:3], *quat_from_rpy(values[3:]).tolist()])
    if len(values) != 7:
        raise MoveItCommanderException(
            "a pose must be a list of 6 numbers (x, y, z, roll, pitch, yaw) or 7 numbers (x, y, z and a quaternion), "
            f"not {len(values)} numbers."
        )
    x, y, z, i, j, k, w = values
    return _checked([x, y, z, w, i, j, k])


def inverse(pose: Floats) -> Floats:
    """Return the inverse of a pose."""
    quat = quat_conjugate(pose[3:])
    return np.concatenate([-quat_rotate(quat, pose[:3]), quat])
