"""Services for the time, physics and lights of the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from frobs_core.util.errors import ConfigurationError, ParameterValueError
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.poses import read_vector
from frobs_ros.bridge.services.offer import Services, done

_MOST_STEPS = 10_000_000
_ATTENUATION = {"attenuation_constant": 0.9, "attenuation_linear": 0.01, "attenuation_quadratic": 0.001}


def set_defaults(bridge: Bridge, lights: Sequence[str]) -> None:
    """Set Gazebo's default solver parameters, and the lights that the world initially contains, by name."""
    from gazebo_msgs.msg import ODEPhysics
    from gazebo_msgs.srv import SetLightPropertiesRequest
    from std_msgs.msg import ColorRGBA

    contact = {"contact_surface_layer": 0.001, "contact_max_correcting_vel": 100.0, "max_contacts": 20}
    bridge.ode = ODEPhysics(sor_pgs_iters=50, sor_pgs_w=1.3, erp=0.2, **contact)
    sun = SetLightPropertiesRequest(diffuse=ColorRGBA(0.8, 0.8, 0.8, 1.0), **_ATTENUATION)
    bridge.lights = dict.fromkeys(lights, sun)


def _get_light(bridge: Bridge, request: Any) -> dict[str, Any]:
    light = bridge.lights.get(request.light_name)
    if light is None:
        return {"success": False, "status_message": "Requested light not found"}
    fields = {name: getattr(light, name) for name in ("diffuse", *_ATTENUATION)}
    return done("GetLightProperties: got properties", **fields)


def _set_light(bridge: Bridge, request: Any) -> dict[str, Any]:
    if request.light_name not in bridge.lights:
        return {"success": False, "status_message": "Requested light not found"}
    bridge.lights[request.light_name] = request
    return done("SetLightProperties: the properties were stored, but lights have no effect in the bridge")


def _delete_light(bridge: Bridge, request: Any) -> dict[str, Any]:
    if bridge.lights.pop(request.light_name, None) is None:
        raise ConfigurationError(f"Requested light {request.light_name} not found")
    return done(f"DeleteLight: {request.light_name} successfully deleted")


def _step(bridge: Bridge, request: Any) -> dict[str, Any]:
    if request.steps > _MOST_STEPS:
        raise ConfigurationError(f"{request.steps} steps were requested; the maximum is {_MOST_STEPS}.")
    bridge.step(request.steps)
    return done(f"StepWorld: made {request.steps} steps", time=bridge.time)


def _get_physics(bridge: Bridge, _: Any) -> dict[str, Any]:
    from geometry_msgs.msg import Vector3

    return done(
        "GetPhysicsProperties: got properties",
        time_step=bridge.world.timestep,
        pause=bridge.loop.paused,
        max_update_rate=bridge.max_update_rate,
        gravity=Vector3(*bridge.world.gravity),
        ode_config=bridge.ode,
    )


def _set_physics(bridge: Bridge, request: Any) -> dict[str, Any]:
    x, y, z = read_vector(request.gravity).tolist()
    if not request.max_update_rate >= 0.0:
        raise ParameterValueError("max_update_rate", request.max_update_rate, "at least 0, where 0 means no limit")
    bridge.world.set_timestep(request.time_step)
    bridge.world.set_gravity((x, y, z))
    bridge.max_update_rate = request.max_update_rate
    bridge.ode = request.ode_config
    bridge.loop.keep_pace()
    return done("physics engine updated")


def _get_world(bridge: Bridge, _: Any) -> dict[str, Any]:
    names = (["ground_plane"] if bridge.world.has_floor else []) + list(bridge.world.models)
    return done("GetWorldProperties: got properties", sim_time=bridge.time, model_names=names, rendering_enabled=False)


SERVICES: Services = {
    "get_light_properties": ("GetLightProperties", _get_light),
    "set_light_properties": ("SetLightProperties", _set_light),
    "delete_light": ("DeleteLight", _delete_light),
    "pause_physics": ("std_srvs/Empty", lambda bridge, _: bridge.set_paused(True)),
    "unpause_physics": ("std_srvs/Empty", lambda bridge, _: bridge.set_paused(False)),
    "reset_simulation": ("std_srvs/Empty", lambda bridge, _: bridge.reset(time=True)),
    "reset_world": ("std_srvs/Empty", lambda bridge, _: bridge.reset(time=False)),
    "step": ("frobs_msgs/StepWorld", _step),
    "get_physics_properties": ("GetPhysicsProperties", _get_physics),
    "set_physics_properties": ("SetPhysicsProperties", _set_physics),
    "get_world_properties": ("GetWorldProperties", _get_world),
}
