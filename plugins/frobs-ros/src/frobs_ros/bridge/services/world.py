"""Services for the time, physics and lights of the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from frobs_core.util.errors import ConfigurationError, ParameterValueError
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.poses import read_vector
from frobs_ros.bridge.services.offer import Offers, done, failed

_MOST_STEPS = 10_000_000


def offer_world_services(offers: Offers) -> None:
    """Provide the services that control the world's time and physics."""
    from gazebo_msgs.msg import ODEPhysics
    from gazebo_msgs.srv import GetPhysicsProperties, GetWorldProperties, SetPhysicsProperties
    from std_srvs.srv import Empty

    from frobs_msgs.srv import StepWorld

    bridge = offers.bridge
    contact = {"contact_surface_layer": 0.001, "contact_max_correcting_vel": 100.0, "max_contacts": 20}
    bridge.ode = ODEPhysics(sor_pgs_iters=50, sor_pgs_w=1.3, erp=0.2, **contact)  # Gazebo's defaults
    offers.offer("pause_physics", Empty, lambda _: bridge.set_paused(True))
    offers.offer("unpause_physics", Empty, lambda _: bridge.set_paused(False))
    offers.offer("reset_simulation", Empty, lambda _: bridge.reset(time=True))
    offers.offer("reset_world", Empty, lambda _: bridge.reset(time=False))
    offers.offer("step", StepWorld, lambda request: _step(bridge, request))
    offers.offer("get_physics_properties", GetPhysicsProperties, lambda _: _get_physics(bridge))
    offers.offer("set_physics_properties", SetPhysicsProperties, lambda request: _set_physics(bridge, request))
    offers.offer("get_world_properties", GetWorldProperties, lambda _: _get_world(bridge))


def offer_light_services(offers: Offers, names: Sequence[str]) -> None:
    """Provide the services for lights. The world initially contains lights with the given names."""
    from gazebo_msgs.srv import DeleteLight, GetLightProperties, SetLightProperties, SetLightPropertiesRequest
    from std_msgs.msg import ColorRGBA

    attenuation = {"attenuation_constant": 0.9, "attenuation_linear": 0.01, "attenuation_quadratic": 0.001}
    sun = SetLightPropertiesRequest(diffuse=ColorRGBA(0.8, 0.8, 0.8, 1.0), **attenuation)
    lights = dict.fromkeys(names, sun)

    def get(request: Any) -> dict[str, Any]:
        if request.light_name not in lights:
            return failed("Requested light not found")
        light = lights[request.light_name]
        fields = {name: getattr(light, name) for name in ("diffuse", *attenuation)}
        return done("GetLightProperties: got properties", **fields)

    def write(request: Any) -> dict[str, Any]:
        if request.light_name not in lights:
            return failed("Requested light not found")
        lights[request.light_name] = request
        return done("SetLightProperties: the properties were stored, but lights have no effect in the bridge")

    def delete(request: Any) -> dict[str, Any]:
        if lights.pop(request.light_name, None) is None:
            return failed(f"DeleteLight: Requested light {request.light_name} not found")
        return done(f"DeleteLight: {request.light_name} successfully deleted")

    offers.offer("get_light_properties", GetLightProperties, get)
    offers.offer("set_light_properties", SetLightProperties, write)
    offers.offer("delete_light", DeleteLight, delete)


def _step(bridge: Bridge, request: Any) -> dict[str, Any]:
    if request.steps > _MOST_STEPS:
        raise ConfigurationError(f"{request.steps} steps were requested; the maximum is {_MOST_STEPS}.")
    bridge.step(request.steps)
    return done(f"StepWorld: made {request.steps} steps", time=bridge.time)


def _get_physics(bridge: Bridge) -> dict[str, Any]:
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


def _get_world(bridge: Bridge) -> dict[str, Any]:
    names = (["ground_plane"] if bridge.world.has_floor else []) + list(bridge.world.models)
    return done("GetWorldProperties: got properties", sim_time=bridge.time, model_names=names, rendering_enabled=False)
