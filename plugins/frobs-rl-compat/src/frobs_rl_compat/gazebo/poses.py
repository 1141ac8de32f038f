"""Creates poses in ROS's format: a position, and a quaternion with the scalar part last."""

from __future__ import annotations

import math
from typing import Any

from frobs_core.util.errors import ConfigurationError

_TOLERANCE = 1e-3


def orientation(x: float, y: float, z: float, w: float) -> tuple[float, float, float, float]:
    """Return a unit quaternion with the scalar part last.

    Four zeros are FRobs_RL's default and mean no rotation in Gazebo, so they are converted to the identity quaternion.
    """
    parts = (float(x), float(y), float(z), float(w))
    if not any(parts):
        return (0.0, 0.0, 0.0, 1.0)
    length = math.sqrt(sum(part * part for part in parts))
    if not math.isfinite(length) or abs(length - 1.0) > _TOLERANCE:
        raise ConfigurationError(
            f"the quaternion (x, y, z, w) = {parts} has the norm {length:.4g} instead of 1. "
            "Use (0, 0, 0, 1) for no rotation."
        )
    return tuple(part / length for part in parts)  # type: ignore[return-value]


def position(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Validate a position [m] and return it as floats."""
    if not all(map(math.isfinite, (x, y, z))):
        raise ConfigurationError(f"the position ({x}, {y}, {z}) is not finite.")
    return (float(x), float(y), float(z))


def pose_message(pos: tuple[float, float, float], quat_xyzw: tuple[float, float, float, float]) -> Any:
    """Return a ``geometry_msgs/Pose`` with a position [m] and a quaternion with the scalar part last."""
    from geometry_msgs.msg import Point, Pose, Quaternion

    return Pose(Point(*position(*pos)), Quaternion(*orientation(*quat_xyzw)))
