"""What a robot that navigates can observe."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.flat_observation import ObservationTerm
from frobs_core.interfaces import Lidar
from frobs_tasks_navigation import terms

OBSERVABLE = ("distance", "bearing", "direction", "position", "yaw", "way_point", "velocity", "lidar", "nearness")
"""Names of all terms."""

_FASTEST = 10.0, 50.0  # [m/s, rad/s] that no robot exceeds, whatever it bumps into
_BEYOND = 2.0  # [m] that a robot can be outside of the area when the step ends that ends the episode
_ROUNDING = 1e-6  # [rad] by which π as float32 is above π


def observation_terms(
    names: Sequence[str], low: Floats, high: Floats, lidar: Lidar | None
) -> dict[str, ObservationTerm]:
    """Return the terms of an observation, in the order of the names.

    Args:
        names: Of :data:`OBSERVABLE`.
        low: (2,) lowest corner of the area [m].
        high: (2,) highest corner of the area [m].
        lidar: That is read; None: none is.
    """
    farthest = float(np.sqrt(((high - low + _BEYOND) ** 2).sum()))
    half_turn = np.array([np.pi + _ROUNDING])
    known = {
        "distance": ObservationTerm(low=np.zeros(1), high=np.array([farthest]), unit="m", scale=0.1),
        "bearing": ObservationTerm(low=-half_turn, high=half_turn, unit="rad"),
        "direction": ObservationTerm(low=-np.ones(2), high=np.ones(2), unit="1"),
        "position": ObservationTerm(low=low - _BEYOND, high=high + _BEYOND, unit="m", scale=0.1),
        "yaw": ObservationTerm(low=-half_turn, high=half_turn, unit="rad"),
        "way_point": ObservationTerm(low=low, high=high, unit="m", scale=0.1),
        "velocity": ObservationTerm(low=-np.array(_FASTEST), high=np.array(_FASTEST), unit="m/s, rad/s"),
    }
    if lidar is not None:
        ones = np.ones(lidar.rays)
        known["lidar"] = ObservationTerm(low=lidar.range_min * ones, high=lidar.range_max * ones, unit="m", scale=0.2)
        low_high = (terms.nearness(np.array([limit])) * ones for limit in (lidar.range_max, lidar.range_min))
        known["nearness"] = ObservationTerm(low=next(low_high), high=next(low_high), unit="1", scale=2.0)
    return {name: known[name] for name in names}
