"""Gets and sets the update rate, the time step, gravity and the settings of the physics engine.

Gazebo has one service that reads all these properties and one that writes all of them. Every change uses both services.
"""

from __future__ import annotations

import math
from typing import Any

from frobs_core.util.errors import ParameterValueError
from frobs_rl_compat.ros.logged_errors import answers
from frobs_ros.errors import ServiceError
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.services import call

_GET, _SET = "/gazebo/get_physics_properties", "/gazebo/set_physics_properties"

TIME_STEP, GRAVITY = 0.001, (0.0, 0.0, -9.81)
ODE = {
    "auto_disable_bodies": False,
    "sor_pgs_precon_iters": 0,
    "sor_pgs_iters": 50,
    "sor_pgs_w": 1.3,
    "sor_pgs_rms_error_tol": 0.0,
    "contact_surface_layer": 0.001,
    "contact_max_correcting_vel": 0.0,
    "cfm": 0.0,
    "erp": 0.2,
    "max_contacts": 20,
}
"""Settings of the ODE physics engine that :func:`gazebo_set_default_properties` applies."""


@answers(False)
def gazebo_set_max_update_rate(max_update_rate: float) -> bool:
    """Set the maximum speed of the simulation."""
    factor = _number("max_update_rate", max_update_rate, 0.0)
    now = _get()
    return _set(now, max_update_rate=factor / now.time_step)


@answers(math.nan)
def gazebo_get_max_update_rate() -> float:
    """Return the maximum speed of the simulation as a real-time factor, or NaN if no simulation responds."""
    now = _get()
    return float(now.max_update_rate * now.time_step)


@answers(False)
def gazebo_set_time_step(new_time_step: float) -> bool:
    """Set the physics time step, without changing the real-time factor."""
    step = _number("new_time_step", new_time_step, 0.0, above=True)
    now = _get()
    return _set(now, time_step=step, max_update_rate=now.max_update_rate * now.time_step / step)


@answers(math.nan)
def gazebo_get_time_step() -> float:
    """Return the physics time step [s], or NaN if no simulation responds."""
    return float(_get().time_step)


@answers(False)
def gazebo_set_gravity(x: float, y: float, z: float) -> bool:
    """Set the gravity vector."""
    return _set(_get(), gravity=_vector(x, y, z))


@answers(None)
def gazebo_get_gravity() -> Any:
    """Return the gravity vector [m/s²] as a ``geometry_msgs/Vector3``, or None if no simulation responds."""
    return _get().gravity


@answers(False)
def gazebo_set_ODE_physics(  # noqa: N802 # FRobs_RL's name
    auto_disable_bodies: bool,
    sor_pgs_precon_iters: int,
    sor_pgs_iters: int,
    sor_pgs_w: float,
    sor_pgs_rms_error_tol: float,
    contact_surface_layer: float,
    contact_max_correcting_vel: float,
    cfm: float,
    erp: float,
    max_contacts: int,
) -> bool:
    """Set the parameters of the ODE physics engine.

    Returns:
        Whether the parameters were set.
    """
    given = dict(locals())
    for name, value in given.items():
        _number(name, float(value), 0.0)
    return _set(_get(), ode=given)


@answers(None)
def gazebo_get_ODE_physics() -> Any:  # noqa: N802 # FRobs_RL's name
    """Return the settings of ODE as a ``gazebo_msgs/ODEPhysics``, or None if no simulation responds."""
    return _get().ode_config


@answers(False)
def gazebo_set_default_properties() -> bool:
    """Set a time step of 1 ms, real-time speed, Earth's gravity, and the default settings of the physics engine."""
    return _set(_get(), time_step=TIME_STEP, max_update_rate=1.0 / TIME_STEP, gravity=_vector(*GRAVITY), ode=ODE)


def _get() -> Any:
    use_ros()
    from gazebo_msgs.srv import GetPhysicsProperties

    answer = call(_GET, GetPhysicsProperties)
    if not answer.success:
        raise ServiceError(_GET, answer.status_message)
    return answer


def _set(now: Any, **changes: Any) -> bool:
    """Change the given properties, and keep the current values of all others. ``ode`` is a mapping."""
    from gazebo_msgs.msg import ODEPhysics
    from gazebo_msgs.srv import SetPhysicsProperties

    if "ode" in changes:
        changes["ode_config"] = ODEPhysics(**changes.pop("ode"))
    names = ("time_step", "max_update_rate", "gravity", "ode_config")
    answer = call(_SET, SetPhysicsProperties, **{name: getattr(now, name) for name in names} | changes)
    if not answer.success:
        raise ServiceError(_SET, answer.status_message)
    return True


def _vector(x: float, y: float, z: float) -> Any:
    use_ros()
    from geometry_msgs.msg import Vector3

    return Vector3(*(_number(name, value) for name, value in zip("xyz", (x, y, z), strict=True)))


def _number(name: str, value: float, low: float = -math.inf, *, above: bool = False) -> float:
    if not math.isfinite(value) or value < low or (above and value == low):
        raise ParameterValueError(name, value, f"finite{f', and {low:g} or more' if low == 0 else ''}")
    return float(value)
