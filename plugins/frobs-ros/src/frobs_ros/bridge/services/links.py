"""Services for links."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.models import Link
from frobs_core.util.errors import UnknownNameError
from frobs_core.util.rotations import quat_conjugate, quat_rotate
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.forces import BodyWrench
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import Motion, Place, place_of, read_state, read_vector, write_pose, write_twist
from frobs_ros.bridge.services.offer import Offers, done, failed

_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def offer_link_services(offers: Offers) -> None:
    """Provide the services for links."""
    from gazebo_msgs.srv import (
        ApplyBodyWrench,
        BodyRequest,
        GetLinkProperties,
        GetLinkState,
        SetLinkProperties,
        SetLinkState,
    )

    bridge = offers.bridge
    offers.offer("get_link_state", GetLinkState, lambda request: _get_state(bridge, request))
    offers.offer("set_link_state", SetLinkState, lambda request: set_link_state(bridge, request.link_state))
    offers.offer("get_link_properties", GetLinkProperties, lambda request: _get_properties(bridge, request))
    offers.offer("set_link_properties", SetLinkProperties, lambda request: _set_properties(bridge, request))
    offers.offer("apply_body_wrench", ApplyBodyWrench, lambda request: _apply(bridge, request))
    offers.offer("clear_body_wrenches", BodyRequest, lambda request: _clear(bridge, request))


def times(bridge: Bridge, request: Any) -> tuple[int, int | None]:
    """Return the start and end of a force [ns].

    The start is never earlier than the current time. The end is None if the requested duration is negative.
    """
    start = max(bridge.world.time_ns, request.start_time.to_nsec())
    length: int = request.duration.to_nsec()
    return start, None if length < 0 else start + length


def _get_state(bridge: Bridge, request: Any) -> dict[str, Any]:
    from gazebo_msgs.msg import LinkState

    try:
        model, link = bridge.world.find_link(request.link_name)
    except UnknownNameError as error:
        return failed(f"GetLinkState: link not found, did you forget to scope the link by model name? {error}")
    try:
        frame, frame_motion = bridge.world.frame(request.reference_frame)
    except UnknownNameError:
        return failed("GetLinkState: reference_frame not found, did you forget to scope the link by model name?")
    motion = model.link_motion(link)
    relative = Motion(motion.linear - frame_motion.linear, motion.angular - frame_motion.angular)
    state = LinkState(link_name=request.link_name, reference_frame=request.reference_frame)
    write_pose(model.link_place(link).seen_from(frame), state.pose)
    write_twist(relative.turned(quat_conjugate(frame.quat_wxyz)), state.twist)
    return done("GetLinkState: got state", link_state=state)


def set_link_state(bridge: Bridge, state: Any) -> dict[str, Any]:
    """Teleport a model by setting the state of its root link. Other links cannot be teleported."""
    try:
        model, link = bridge.world.find_link(state.link_name)
    except UnknownNameError as error:
        return failed(f"SetLinkState: link [{state.link_name}] does not exist. {error}")
    if link != model.links[0]:
        return failed(
            f"SetLinkState: the pose of link '{link}' depends on the joints of model '{model.name}'; set the state of "
            f"the root link '{model.links[0]}', or move the joints with set_model_configuration"
        )
    try:
        frame = bridge.world.frame(state.reference_frame)
    except UnknownNameError:
        return failed("SetLinkState: reference_frame is not a valid entity name")
    bridge.world.put(model, *read_state(state, *frame))
    return done("SetLinkState: success")


def _link(model: Model, name: str) -> Link | None:
    placement = model.description.placement
    return None if placement is None else next(link for link in placement.model.links if link.name == name)


def _get_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    from geometry_msgs.msg import Pose

    try:
        model, name = bridge.world.find_link(request.link_name)
    except UnknownNameError as error:
        return failed(f"GetLinkProperties: link [{request.link_name}] not found. {error}")
    link = _link(model, name)
    if link is None or link.inertial is None or bridge.world.simulation is None:
        return done("GetLinkProperties: got properties", gravity_mode=not model.is_static)
    mass = float(bridge.world.simulation.parameter("mass", f"{model.key}/{name}")[0])
    scale = mass / link.inertial.mass if link.inertial.mass else 1.0
    centre = Place(place_of(link.inertial.origin).pos, np.array([1.0, 0.0, 0.0, 0.0]))
    # As in Gazebo, the inertia is about the center of mass, and its axes are oriented as in the model file.
    inertia = dict(zip(_INERTIA, (scale * value for value in link.inertial.inertia), strict=True))
    return done(
        "GetLinkProperties: got properties", com=write_pose(centre, Pose()), gravity_mode=True, mass=mass, **inertia
    )


def _set_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    properties = _get_properties(bridge, request)
    if not properties["success"]:
        return failed(str(properties["status_message"]).replace("Get", "Set"))
    model, name = bridge.world.find_link(request.link_name)
    if "mass" not in properties:
        return failed(f"SetLinkProperties: link '{name}' is static or has no mass, so its properties cannot be set")
    if not request.mass > 0.0:
        return failed(f"SetLinkProperties: the mass is {request.mass} kg; it must be above 0")
    scale = request.mass / properties["mass"]
    same = np.allclose(read_vector(request.com.position), read_vector(properties["com"].position), atol=1e-9)
    inertia = np.array([getattr(request, key) for key in _INERTIA])
    kept = np.array([properties[key] for key in _INERTIA])
    if not same or not request.gravity_mode or not (np.allclose(inertia, kept) or np.allclose(inertia, scale * kept)):
        return failed(
            "SetLinkProperties: nothing was set. Only the mass can be changed, and the inertia is scaled by the "
            "same ratio; set com, gravity_mode and inertia to the values that get_link_properties returns"
        )
    bridge.world.write_parameter("mass", f"{model.key}/{name}", np.array([request.mass]))
    return done("SetLinkProperties: properties set")


def _apply(bridge: Bridge, request: Any) -> dict[str, Any]:
    world = bridge.world
    try:
        model, link = world.find_link(request.body_name)
    except UnknownNameError as error:
        return failed(f"ApplyBodyWrench: body [{request.body_name}] does not exist. {error}")
    if model.is_static:
        return failed(f"ApplyBodyWrench: model '{model.name}' is static, so forces have no effect")
    try:
        frame, _ = world.frame(request.reference_frame)
    except UnknownNameError as error:
        return failed(f"ApplyBodyWrench: reference_frame [{request.reference_frame}] not found. {error}")
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
    world.forces.add(BodyWrench(model.name, link, force, torque, *times(bridge, request)))
    return done("")


def _clear(bridge: Bridge, request: Any) -> None:
    model, link = bridge.world.find_link(request.body_name)
    bridge.world.forces.clear_link(model.name, link)
