"""Pure functions that compute reward terms from arrays with one row per environment."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import components


def length(vector: Floats) -> Floats:
    """Return the lengths (n,) of vectors (n, k)."""
    total = sum(component * component for component in components(vector))
    return np.asarray(np.sqrt(total)).reshape(len(vector))


def nearness(distance: Floats, reach: float) -> Floats:
    """Return 1 − tanh(distance / reach): 1 at the goal, 0.24 at ``reach``, and 0 far away.

    Args:
        distance: Distances, (n,) [m], ≥ 0.
        reach: Distance at which the value has decreased to 0.24 [m].
    """
    return np.asarray(1.0 - np.tanh(distance / reach))
