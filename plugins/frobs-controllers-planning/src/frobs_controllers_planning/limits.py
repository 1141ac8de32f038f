"""Position, velocity and acceleration limits for planning."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from frobs_core.models import RobotModel
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, check_name
from frobs_core.util.validation import non_negative, positive

SECONDS_TO_FULL_SPEED = 0.5
"""Default time for a joint to reach its velocity limit [s]. This time determines the acceleration limits, which URDF
does not define.
"""

UNLIMITED_RANGE = math.pi
"""Position limit, ± [rad or m], of joints without position limits in the model file."""

UNLIMITED_VELOCITY = 2.0
"""Velocity limit [rad/s or m/s] of joints without a velocity limit in the model file."""


def ranges(model: RobotModel) -> tuple[Floats, Floats]:
    """Return finite lower and upper position limits, (dof,) [rad or m] each."""
    limits = [(joint.limits.lower, joint.limits.upper) for joint in model.actuated_joints]
    lower = np.array([-UNLIMITED_RANGE if math.isinf(low) else low for low, _ in limits])
    upper = np.array([UNLIMITED_RANGE if math.isinf(high) else high for _, high in limits])
    return lower, np.maximum(upper, lower)


def velocities(model: RobotModel) -> Floats:
    """Return finite velocity limits, (dof,) [rad/s or m/s]."""
    limits = np.array([joint.limits.velocity for joint in model.actuated_joints])
    return np.where(np.isfinite(limits) & (limits > 0.0), limits, UNLIMITED_VELOCITY)


def accelerations(model: RobotModel, given: float | Mapping[str, float] | None) -> Floats:
    """Return the acceleration limits, (dof,) [rad/s² or m/s²].

    Args:
        model: Model of the robot.
        given: One limit for all joints, or limits by joint name. A joint without a given limit reaches its velocity
            limit in :data:`SECONDS_TO_FULL_SPEED`.

    Raises:
        UnknownNameError: A name in the mapping is not an actuated joint.
        ConfigurationError: A value is not positive.
    """
    limits = velocities(model) / SECONDS_TO_FULL_SPEED
    chosen = given if isinstance(given, Mapping) else {} if given is None else dict.fromkeys(model.joint_names, given)
    for name, value in chosen.items():
        check_name(f"actuated joint of '{model.name}'", name, model.joint_names)
        limits[model.joint_names.index(name)] = number("max_acceleration", value, "rad/s² or m/s²")
    return limits


def number(name: str, value: object, unit: str, *, largest: float = math.inf, zero: bool = False) -> float:
    """Return a parameter as a float after checking its value.

    Args:
        name: Name of the parameter, used in the error message.
        value: Value of the parameter.
        unit: Unit of the value, used in the error message.
        largest: Maximum value.
        zero: Whether 0 is allowed.

    Raises:
        ConfigurationError: The value is not a finite number in (0, ``largest``], or in [0, ``largest``] if ``zero`` is
            set.
    """
    name = f"trajectory: {name}"
    limit = non_negative(name, value, unit) if zero else positive(name, value, unit)
    if limit > largest:
        raise ParameterValueError(name, value, f"at most {largest:g} [{unit}]")
    return limit
