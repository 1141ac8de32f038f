"""The terms of the reaching tasks: small pure functions, row by row, each of use alone.

A row of a batch gets the bits that it would get alone, in any memory layout: all is elementwise. A single row is left
to Python's own floats where they are faster; they round alike.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np

from frobs_core.arrays import Floats, Mask

_T = TypeVar("_T", float, Floats)


def distance(offset: Floats) -> Floats:
    """Return the length of vectors.

    Args:
        offset: (..., 3) [m]

    Returns:
        (...) [m]
    """
    if offset.shape == (1, 3):
        ((x, y, z),) = offset.tolist()
        return np.array([math.sqrt(x * x + y * y + z * z)])
    x, y, z = np.moveaxis(offset, -1, 0)
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def turn_back(quat_wxyz: Floats, vector: Floats, out: Floats) -> None:
    """Write vectors as a frame sees them that is turned.

    Args:
        quat_wxyz: (n, 4) the frame's orientation.
        vector: (n, 3) in the frame that the orientation refers to.
        out: (n, 3) in the turned frame.
    """
    if len(vector) == 1:
        out[0] = _turned_back(*quat_wxyz[0].tolist(), *vector[0].tolist())
    else:
        out[:, 0], out[:, 1], out[:, 2] = _turned_back(*quat_wxyz.T, *vector.T)


def _turned_back(w: _T, x: _T, y: _T, z: _T, a: _T, b: _T, c: _T) -> tuple[_T, _T, _T]:
    p, q, r = b * z - c * y, c * x - a * z, a * y - b * x  # vector × axis, which turns back
    p, q, r = p + p, q + q, r + r
    return a + (w * p + (q * z - r * y)), b + (w * q + (r * x - p * z)), c + (w * r + (p * y - q * x))


def unit_direction(offset: Floats) -> Floats:
    """Return vectors scaled to length 1; the zero vector stays zero.

    Args:
        offset: (..., 3) [m]

    Returns:
        (..., 3), each component in [−1, 1].
    """
    length = distance(offset)[..., None]
    return offset / np.where(length == 0.0, 1.0, length)


def gaussian(distance: Floats, width: float) -> Floats:
    """Return exp(−(distance / width)²), in (0, 1]: 1 at the goal, 0.37 at one width from it.

    Args:
        distance: (...) [m]
        width: [m]
    """
    return np.exp(distance * distance * (-1.0 / (width * width)))


def inside(distance: Floats, tolerance: float) -> Mask:
    """Return where a distance is at most the tolerance.

    Args:
        distance: (...) [m]
        tolerance: [m]

    Returns:
        (...) bool.
    """
    return distance <= tolerance


def missed(distance: Floats, tolerance: float) -> Floats:
    """Return the sparse reward: 0 where a distance is at most the tolerance, else −1.

    Args:
        distance: (...) [m]
        tolerance: [m]
    """
    return np.where(distance <= tolerance, 0.0, -1.0)


def at_limits(joint_positions: Floats, lower: Floats, upper: Floats, margin: float) -> Mask:
    """Return where any joint is at one of its limits, or beyond.

    Args:
        joint_positions: (..., dof) [rad or m]
        lower: Broadcasts to (..., dof) [rad or m].
        upper: Broadcasts to (..., dof) [rad or m].
        margin: How near a limit counts [rad or m].

    Returns:
        (...) bool.
    """
    near = (joint_positions <= lower + margin) | (joint_positions >= upper - margin)
    return np.asarray(near.any(axis=-1))


def oscillation(time: Floats, amplitude: Floats, frequency: Floats, phase: Floats) -> tuple[Floats, Floats]:
    """Return amplitude · sin(2π · frequency · time + phase) and its rate of change.

    Args:
        time: (...) [s]
        amplitude: (..., 3) [m]
        frequency: (..., 3) [Hz]
        phase: (..., 3) [rad]

    Returns:
        offset (..., 3) [m] and velocity (..., 3) [m/s].
    """
    rate = 2.0 * np.pi * frequency
    angle = rate * time[..., None] + phase
    return amplitude * np.sin(angle), amplitude * rate * np.cos(angle)
