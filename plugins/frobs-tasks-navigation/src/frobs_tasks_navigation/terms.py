"""Pure functions that compute observation and reward terms."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import Floats, Mask


def yaw_of(quat_wxyz: Floats) -> Floats:
    """Return the yaw angle of a frame, in [−π, π] [rad].

    Args:
        quat_wxyz: Orientation of the frame, scalar first, (..., 4).

    Returns:
        The yaw angle, (...).
    """
    if quat_wxyz.shape == (1, 4):  # for a single row, Python floats are faster and round identically
        ((w, x, y, z),) = quat_wxyz.tolist()
        return np.arctan2([2.0 * (w * z + x * y)], [1.0 - 2.0 * (y * y + z * z)])
    w, x, y, z = (quat_wxyz[..., i] for i in range(4))
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def quat_of(yaw: Floats) -> Floats:
    """Return scalar-first quaternions (..., 4) for rotations about the vertical by ``yaw`` (...) [rad]."""
    zeros = np.zeros_like(yaw)
    return np.stack([np.cos(0.5 * yaw), zeros, zeros, np.sin(0.5 * yaw)], axis=-1)


def in_frame(offset: Floats, yaw: Floats) -> Floats:
    """Return the forward and left components of an offset in the robot's frame, (..., 2) [m].

    Args:
        offset: Vector from the robot to an object in the world frame, (..., 2) [m].
        yaw: Yaw of the robot, (...) [rad].
    """
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y = offset[..., 0], offset[..., 1]
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1)


def bearing(offset: Floats, yaw: Floats) -> Floats:
    """Return the angle at which a robot sees an object, (...) in [−π, π] [rad]: 0 ahead, positive to the left.

    The angle is 0 if the distance is 0. The arguments are the same as those of :func:`in_frame`.
    """
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y = offset[..., 0], offset[..., 1]
    return np.arctan2(cos * y - sin * x, cos * x + sin * y)


def distance(offset: Floats) -> Floats:
    """Return the lengths (...) [m] of vectors (..., 2) [m]."""
    x, y = offset[..., 0], offset[..., 1]
    return np.sqrt(x * x + y * y)


def nearness(ranges: Floats) -> Floats:
    """Return 1 m / (1 m + range), in (0, 1], which resolves close objects more finely than distant ones.

    Args:
        ranges: Lidar ranges, (...) [m], ≥ 0.
    """
    return 1.0 / (1.0 + ranges)


def outside(pos: Floats, low: Floats, high: Floats) -> Mask:
    """Return whether points (..., 2) [m] are outside the rectangle from ``low`` to ``high``, (2,) [m] each."""
    anywhere: Mask = np.logical_or.reduce((pos < low) | (pos > high), axis=-1)
    return anywhere


def distance_to_rectangles(pos: Floats, centre: Floats, yaw: Floats, half: Floats) -> Floats:
    """Return the distances between points and rectangles [m], 0 for points inside a rectangle.

    Args:
        pos: Points, (..., 1, 2) [m].
        centre: Centers of the rectangles, broadcastable to (..., k, 2) [m].
        yaw: Angles of the rectangles, broadcastable to (..., k) [rad].
        half: Half edge lengths of the rectangles, broadcastable to (..., k, 2) [m].

    Returns:
        The distances, (..., k).
    """
    beyond = np.maximum(np.abs(in_frame(pos - centre, yaw)) - half, 0.0)
    return distance(beyond)


def to_and_fro(time: Floats, first_turn: Floats, turn_every: Floats) -> Floats:
    """Return the forward travel time minus the backward travel time of a periodically reversing motion [s].

    Args:
        time: Time since the start of the motion, (...) [s].
        first_turn: Time of the first reversal [s].
        turn_every: Time between two reversals [s].

    Returns:
        The difference, (...). After the first reversal, the difference is in [``first_turn`` − ``turn_every``,
        ``first_turn``].
    """
    period = 2.0 * turn_every
    phase = np.mod(time - first_turn, period)  # time since the last reversal to backward motion
    swung = first_turn - np.minimum(phase, period - phase)
    return np.where(time < first_turn, time, swung)
