"""Observation terms that are clipped to their bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from frobs_core.description import ObservationTerm
from frobs_core.util.arrays import Floats


def bounded(
    read: Callable[[], Floats], size: int, limit: float, unit: str, scale: float = 1.0, *, proprioceptive: bool = False
) -> ObservationTerm:
    """Return an observation term whose values are clipped to [−``limit``, ``limit``].

    Args:
        read: Function that returns the values, (num_envs, ``size``).
        size: Number of values per environment.
        limit: Maximum absolute value of the term.
        unit: Unit of the values.
        scale: Suggested factor by which a learner scales the values.
        proprioceptive: Whether the robot itself can measure the values.
    """
    high = np.full(size, limit)
    return ObservationTerm(
        read=lambda: np.minimum(np.maximum(read(), -limit), limit),
        low=-high,
        high=high,
        unit=unit,
        scale=scale,
        proprioceptive=proprioceptive,
    )
