"""Converts laser scans to ranges along the rays of a lidar."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from frobs_core.description import Lidar
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError


def rays_of(scan: Any, lidar: Lidar) -> Floats:
    """Return the ranges of a scan along the rays of a lidar, using the nearest beam for each ray.

    Returns:
        Range along each ray, (rays,) [m].

    Raises:
        ConfigurationError: The scan does not cover all rays, or contains no beams.
    """
    ranges = np.asarray(scan.ranges, np.float64)
    directions = np.arctan2(lidar.directions[:, 1], lidar.directions[:, 0])
    step = scan.angle_increment
    if not len(ranges) or step == 0.0:
        raise ConfigurationError("the laser scan has no beams, or its angle_increment is 0.")
    beams = scan.angle_min + step * np.arange(len(ranges))
    off = np.abs((beams[None] - directions[:, None] + math.pi) % (2.0 * math.pi) - math.pi)
    nearest = off.argmin(axis=1)
    missed = off[np.arange(len(directions)), nearest] > 0.51 * abs(step)
    if missed.any():
        raise ConfigurationError(
            f"the policy requires a laser beam at {np.degrees(directions[missed.argmax()]):.0f}°, but the scan has none; "
            f"the scan ranges from {math.degrees(beams[0]):.0f}° to {math.degrees(beams[-1]):.0f}°."
        )
    read: Floats = ranges[nearest]
    return read
