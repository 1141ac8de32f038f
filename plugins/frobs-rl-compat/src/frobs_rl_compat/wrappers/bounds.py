"""Validation of space bounds for the two normalization wrappers."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import IncompatibleSpaceError


def finite_bounds(wrapper: str, kind: str, space: gym.Space[Any]) -> tuple[Floats, Floats]:
    """Return the bounds of a Box as new float64 arrays of the same shape.

    Args:
        wrapper: Name of the wrapper, for the error message.
        kind: ``"action"`` or ``"observation"``, for the error message.
        space: The space.

    Raises:
        ConfigurationError: The space is not a Box or has an unbounded component.
    """
    if not isinstance(space, gym.spaces.Box):
        raise IncompatibleSpaceError(
            wrapper, space, f"requires a Box {kind} space, but this environment has {space}; remove the wrapper."
        )
    low, high = space.low.astype(np.float64), space.high.astype(np.float64)
    unbounded = np.argwhere(~(np.isfinite(low) & np.isfinite(high)))
    if len(unbounded):
        first = tuple(int(i) for i in unbounded[0])
        raise IncompatibleSpaceError(
            wrapper,
            space,
            f"requires finite bounds, but {len(unbounded)} of {low.size} {kind} components are unbounded, such "
            f"as component {first[0] if len(first) == 1 else first} with the range [{low[first]}, {high[first]}]; set "
            f"finite bounds first, for example with gymnasium.wrappers.Transform{kind.title()}.",
        )
    return low, high
