"""Validation of the options passed to ``reset``."""

from __future__ import annotations

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ResetOptionError
from frobs_core.util.validation import numbers
from frobs_tasks_navigation import terms


def checked_goal(goal: Floats, low: Floats, high: Floats) -> Floats:
    """Validate and return user-specified goals, (n, 2) [m].

    Args:
        goal: User-specified goals, one row for each environment.
        low: Minimum corner of the area, (2,) [m].
        high: Maximum corner of the area, (2,) [m].

    Raises:
        ConfigurationError: A goal does not consist of two numbers, or is outside the area.
    """
    if goal.shape[1:] != (2,):
        raise ResetOptionError("goal", f"has the shape {goal.shape[1:]}; expected the shape (2,), with x and y [m].")
    _check_inside("goal", goal, low, high)
    return goal


def checked_start(start: Floats, low: Floats, high: Floats) -> Floats:
    """Validate and return user-specified initial poses, (n, 3) as x, y [m] and yaw [rad].

    See :func:`checked_goal` for ``low`` and ``high``.

    Raises:
        ConfigurationError: A start does not consist of three numbers, or is outside the area.
    """
    if start.shape[1:] != (3,):
        raise ResetOptionError(
            "start", f"has the shape {start.shape[1:]}; expected the shape (3,), with x, y [m] and yaw [rad]."
        )
    _check_inside("start", start[:, :2], low, high)
    return start


def _check_inside(what: str, pos: Floats, low: Floats, high: Floats) -> None:
    outside = terms.outside(pos, low, high)
    if outside.any():
        raise ResetOptionError(
            what,
            f"is {numbers(pos[outside][0])} m, outside the floor plan's area, {numbers(low)} to {numbers(high)} m.",
        )
