"""Validation of the options passed to ``reset``."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ResetOptionError
from frobs_core.util.validation import numbers
from frobs_tasks_reach.sampling import in_box

_ROUNDING = 1e-6  # [rad or m] amount by which a joint position may exceed its limits due to float32 rounding


def checked_goal(goal: Floats, low: Floats, high: Floats) -> Floats:
    """Validate and return user-specified goals, (n, 3) [m].

    Args:
        goal: User-specified goals, one row for each environment.
        low: Minimum coordinates of a goal, (3,) [m].
        high: Maximum coordinates of a goal, (3,) [m].

    Raises:
        ConfigurationError: A goal does not consist of three numbers, or is outside [``low``, ``high``].
    """
    if goal.shape[1:] != (3,):
        raise ResetOptionError("goal", f"has the shape {goal.shape[1:]}; it must be (3,): x, y, z [m].")
    inside = in_box(goal, low, high)
    if not inside.all():
        raise ResetOptionError(
            "goal",
            f"is {numbers(goal[~inside][0])} m, which is out of reach; goals must be between {numbers(low)} and "
            f"{numbers(high)} m.",
        )
    return goal


def checked_joint_positions(positions: Floats, robot: RobotHandle) -> Floats:
    """Validate user-specified joint positions (n, dof) [rad or m], and clip them to correct rounding errors.

    Raises:
        ConfigurationError: The number of joint positions is wrong, or a joint position is outside the limits.
    """
    lower, upper = robot.position_lower[0], robot.position_upper[0]
    if positions.shape[1:] != lower.shape:
        raise ResetOptionError(
            "joint_positions",
            f"has the shape {positions.shape[1:]}; it must be {lower.shape}, with one value for each of "
            f"{', '.join(robot.joint_names)}.",
        )
    outside = (positions < lower - _ROUNDING) | (positions > upper + _ROUNDING)  # (n, dof)
    if outside.any():
        row, joint = np.argwhere(outside)[0]
        raise ResetOptionError(
            "joint_positions",
            f"puts '{robot.joint_names[joint]}' at {positions[row, joint]:.6g}, outside its limits "
            f"[{lower[joint]:.6g}, {upper[joint]:.6g}].",
        )
    return np.clip(positions, lower, upper)
