"""How far and how fast the joints of a robot may be asked to move."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ParameterValueError, UnknownNameError
from frobs_core.models import RobotModel
from frobs_core.validation import non_negative, positive

SECONDS_TO_FULL_SPEED = 0.5
"""[s] in which a joint gets to its velocity limit where nobody says how fast it may accelerate: no URDF does."""

UNLIMITED_RANGE = math.pi
"""± [rad or m] where a joint without position limits is moved."""

UNLIMITED_VELOCITY = 2.0
"""[rad/s or m/s] of a joint whose file gives no velocity limit."""


def ranges(model: RobotModel) -> tuple[Floats, Floats]:
    """Return the position limits, finite, (dof,) each [rad or m]."""
    limits = [(joint.limits.lower, joint.limits.upper) for joint in model.actuated_joints]
    lower = np.array([-UNLIMITED_RANGE if math.isinf(low) else low for low, _ in limits])
    upper = np.array([UNLIMITED_RANGE if math.isinf(high) else high for _, high in limits])
    return lower, np.maximum(upper, lower)


def velocities(model: RobotModel) -> Floats:
    """Return the velocity limits, finite, (dof,) [rad/s or m/s]."""
    limits = np.array([joint.limits.velocity for joint in model.actuated_joints])
    return np.where(np.isfinite(limits) & (limits > 0.0), limits, UNLIMITED_VELOCITY)


def accelerations(model: RobotModel, given: float | Mapping[str, float] | None) -> Floats:
    """Return the acceleration limits, (dof,) [rad/s² or m/s²].

    Args:
        model: The robot.
        given: One for all joints, or by joint name; None, and for a joint that is left out: what gets it to its
            velocity limit in :data:`SECONDS_TO_FULL_SPEED`.

    Raises:
        UnknownNameError: A name is no actuated joint's.
        ConfigurationError: One is not above 0.
    """
    found = velocities(model) / SECONDS_TO_FULL_SPEED
    chosen = given if isinstance(given, Mapping) else {} if given is None else dict.fromkeys(model.joint_names, given)
    for name, value in chosen.items():
        if name not in model.joint_names:
            raise UnknownNameError(f"actuated joint of '{model.name}'", name, model.joint_names)
        found[model.joint_names.index(name)] = number("max_acceleration", value, "rad/s² or m/s²")
    return found


def number(name: str, value: object, unit: str, *, largest: float = math.inf, zero: bool = False) -> float:
    """Return a parameter as a float.

    Args:
        name: For the message.
        value: What was given.
        unit: For the message.
        largest: That it may be.
        zero: Whether it may be 0.

    Raises:
        ConfigurationError: It is no finite number in (0, largest], or [0, largest].
    """
    name = f"trajectory: {name}"
    found = non_negative(name, value, unit) if zero else positive(name, value, unit)
    if found > largest:
        raise ParameterValueError(name, value, f"at most {largest:g} [{unit}]")
    return found
