"""Services for links."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.models import Link
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.rotations import quat_conjugate, quat_rotate
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.forces import BodyWrench
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import Motion, Place, place_of, pose_message, read_state, read_vector, twist_message
from frobs_ros.bridge.services.offer import Services, done, found
from frobs_ros.messages.types import find_type

_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def times(bridge: Bridge, request: Any) -> tuple[int, int | None]:
    """Return the start and end of a force [ns].

    The start is never earlier than the current time. The end is None if the requested duration is negative.
    """
    start = max(bridge.world.time_ns, request.start_time.to_nsec())
    length: int = request.duration.to_nsec()
    return start, None if length < 0 else start + length


def _get_state(bridge: Bridge, request: Any) -> dict[str, Any]:
    hint = "not found, did you forget to scope the link by model name?"
    model, link = found(bridge.world.find_link, request.link_name, f"link {hint}", explain=True)
    frame, frame_motion = found(bridge.world.frame, request.reference_frame, f"reference_frame {hint}")
    motion = model.link_motion(link)
    relative = Motion(motion.linear - frame_motion.linear, motion.angular - frame_motion.angular)
    state = find_type("gazebo_msgs/LinkState")(
        request.link_name,
        pose_message(model.link_place(link).seen_from(frame)),
        twist_message(relative.turned(quat_conjugate(frame.quat_wxyz))),
        request.reference_frame,
    )
    return done("GetLinkState: got state", link_state=state)


def set_link_state(bridge: Bridge, state: Any) -> dict[str, Any]:
    """Teleport a model by setting the state of its root link. Other links cannot be teleported."""
    unknown = f"link [{state.link_name}] does not exist."
    model, link = found(bridge.world.find_link, state.link_name, unknown, explain=True)
    if link != model.links[0]:
        raise ConfigurationError(
            f"the pose of link '{link}' depends on the joints of model '{model.name}'; set the state of "
            f"the root link '{model.links[0]}', or move the joints with set_model_configuration"
        )
    frame = found(bridge.world.frame, state.reference_frame, "reference_frame is not a valid entity name")
    bridge.world.put(model, *read_state(state, *frame))
    return done("SetLinkState: success")


def _link(model: Model, name: str) -> Link | None:
    placement = model.description.placement
    return None if placement is None else next(link for link in placement.model.links if link.name == name)


def _get_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    unknown = f"link [{request.link_name}] not found."
    model, name = found(bridge.world.find_link, request.link_name, unknown, explain=True)
    link = _link(model, name)
    if link is None or link.inertial is None or bridge.world.simulation is None:
        return done("GetLinkProperties: got properties", gravity_mode=not model.is_static)
    mass = float(bridge.world.parameter("mass", f"{model.key}/{name}")[0])
    scale = mass / link.inertial.mass if link.inertial.mass else 1.0
    centre = Place(place_of(link.inertial.origin).pos, np.array([1.0, 0.0, 0.0, 0.0]))
    # As in Gazebo, the inertia is about the center of mass, and its axes are oriented as in the model file.
    inertia = dict(zip(_INERTIA, (scale * value for value in link.inertial.inertia), strict=True))
    return done("GetLinkProperties: got properties", com=pose_message(centre), gravity_mode=True, mass=mass, **inertia)


def _set_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    properties = _get_properties(bridge, request)
    model, name = bridge.world.find_link(request.link_name)
    if "mass" not in properties:
        raise ConfigurationError(f"link '{name}' is static or has no mass, so its properties cannot be set")
    if not request.mass > 0.0:
        raise ConfigurationError(f"the mass is {request.mass} kg; it must be above 0")
    scale = request.mass / properties["mass"]
    same = np.allclose(read_vector(request.com.position), read_vector(properties["com"].position), atol=1e-9)
    inertia = np.array([getattr(request, key) for key in _INERTIA])
    kept = np.array([properties[key] for key in _INERTIA])
    if not same or not request.gravity_mode or not (np.allclose(inertia, kept) or np.allclose(inertia, scale * kept)):
        raise ConfigurationError(
            "nothing was set. Only the mass can be changed, and the inertia is scaled by the "
            "same ratio; set com, gravity_mode and inertia to the values that get_link_properties returns"
        )
    bridge.world.write_parameter("mass", f"{model.key}/{name}", np.array([request.mass]))
    return done("SetLinkProperties: properties set")


def _apply(bridge: Bridge, request: Any) -> dict[str, Any]:
    world = bridge.world
    unknown = f"body [{request.body_name}] does not exist."
    model, link = found(world.find_link, request.body_name, unknown, explain=True)
    if model.is_static:
        raise ConfigurationError(f"model '{model.name}' is static, so forces have no effect")
    unknown = f"reference_frame [{request.reference_frame}] not found."
    frame, _ = found(world.frame, request.reference_frame, unknown, explain=True)
    force = quat_rotate(frame.quat_wxyz, read_vector(request.wrench.force))
    torque = quat_rotate(frame.quat_wxyz, read_vector(request.wrench.torque))
    # If the reference frame is the world frame, Gazebo ignores the reference point.
    if request.reference_frame not in ("", "world", "map", "/map"):
        described = _link(model, link)
        inertial = described.inertial if described is not None else None
        origin = place_of(inertial.origin).pos if inertial is not None else np.zeros(3)
        place = model.link_place(link)
        centre = place.pos + quat_rotate(place.quat_wxyz, origin)
        point = frame.pos + quat_rotate(frame.quat_wxyz, read_vector(request.reference_point))
        torque = torque + np.cross(point - centre, force)
    world.forces.add(BodyWrench(model.name, link, *times(bridge, request), force, torque))
    return done("")


def _clear(bridge: Bridge, request: Any) -> None:
    model, link = bridge.world.find_link(request.body_name)
    bridge.world.forces.remove(model.name, link, BodyWrench)


SERVICES: Services = {
    "get_link_state": ("GetLinkState", _get_state),
    "set_link_state": ("SetLinkState", lambda bridge, request: set_link_state(bridge, request.link_state)),
    "get_link_properties": ("GetLinkProperties", _get_properties),
    "set_link_properties": ("SetLinkProperties", _set_properties),
    "apply_body_wrench": ("ApplyBodyWrench", _apply),
    "clear_body_wrenches": ("BodyRequest", _clear),
}
