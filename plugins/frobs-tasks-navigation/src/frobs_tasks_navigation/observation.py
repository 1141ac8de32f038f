"""Observation terms for navigation tasks."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from frobs_core.description import Lidar, ObservationTerm
from frobs_core.util.arrays import Floats
from frobs_tasks_navigation import terms

OBSERVABLE = ("distance", "bearing", "direction", "position", "yaw", "way_point", "velocity", "lidar", "nearness")
"""Names of all available observation terms."""

_PROPRIOCEPTIVE = ("velocity", "lidar", "nearness")  # measured by the robot, without knowledge of the floor plan
_FASTEST = 10.0, 50.0  # [m/s, rad/s] upper limits of a robot's velocities, even in collisions
_BEYOND = 2.0  # [m] maximum distance from the area at the step that ends the episode
_ROUNDING = 1e-6  # [rad] amount by which float32's π exceeds π


def observable(
    reads: Mapping[str, Callable[[], Floats]], low: Floats, high: Floats, lidar: Lidar | None
) -> dict[str, ObservationTerm]:
    """Return all observation terms that are available for a robot.

    Args:
        reads: Functions that return the values of the terms in :data:`OBSERVABLE`, by name.
        low: Minimum corner of the area, (2,) [m].
        high: Maximum corner of the area, (2,) [m].
        lidar: The robot's lidar, or None to omit the lidar terms.
    """
    farthest = float(np.sqrt(((high - low + _BEYOND) ** 2).sum()))
    half_turn, fastest = np.array([np.pi + _ROUNDING]), np.array(_FASTEST)
    bounds: dict[str, tuple[Floats, Floats, str, float]] = {
        "distance": (np.zeros(1), np.array([farthest]), "m", 0.1),
        "bearing": (-half_turn, half_turn, "rad", 1.0),
        "direction": (-np.ones(2), np.ones(2), "1", 1.0),
        "position": (low - _BEYOND, high + _BEYOND, "m", 0.1),
        "yaw": (-half_turn, half_turn, "rad", 1.0),
        "way_point": (low, high, "m", 0.1),
        "velocity": (-fastest, fastest, "m/s, rad/s", 1.0),
    }
    if lidar is not None:
        ones = np.ones(lidar.rays)
        nearest, farthest_ray = lidar.range_min * ones, lidar.range_max * ones
        bounds["lidar"] = nearest, farthest_ray, "m", 0.2
        bounds["nearness"] = terms.nearness(farthest_ray), terms.nearness(nearest), "1", 2.0
    return {
        name: ObservationTerm(
            read=reads[name], low=low, high=high, unit=unit, scale=scale, proprioceptive=name in _PROPRIOCEPTIVE
        )
        for name, (low, high, unit, scale) in bounds.items()
    }
