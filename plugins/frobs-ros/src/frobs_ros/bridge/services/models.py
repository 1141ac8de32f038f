"""Services that spawn, delete, inspect and teleport models."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.util.errors import ConfigurationError, FrobsError, UnknownNameError
from frobs_core.util.rotations import quat_conjugate
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.model import Description, Model
from frobs_ros.bridge.poses import Motion, place_of, read_pose, read_state, write_pose, write_twist
from frobs_ros.bridge.sdf import describe_sdf
from frobs_ros.bridge.services.offer import Offers, done, failed
from frobs_ros.bridge.urdf import describe_urdf


def offer_model_services(offers: Offers) -> None:
    """Provide the services for models."""
    from gazebo_msgs.srv import (
        DeleteModel,
        GetModelProperties,
        GetModelState,
        SetModelConfiguration,
        SetModelState,
        SpawnModel,
    )

    bridge = offers.bridge
    # In Gazebo, either service accepts both formats, and clients rely on this behavior.
    offers.offer("spawn_urdf_model", SpawnModel, lambda request: _spawn(bridge, request))
    offers.offer("spawn_sdf_model", SpawnModel, lambda request: _spawn(bridge, request))
    offers.offer("delete_model", DeleteModel, lambda request: _delete(bridge, request))
    offers.offer("get_model_state", GetModelState, lambda request: _get_state(bridge, request))
    offers.offer("set_model_state", SetModelState, lambda request: set_model_state(bridge, request.model_state))
    offers.offer("get_model_properties", GetModelProperties, lambda request: _get_properties(bridge, request))
    offers.offer("set_model_configuration", SetModelConfiguration, lambda request: _set_configuration(bridge, request))


def describe_text(text: str) -> Description:
    """Parse a model from URDF, xacro or SDF text.

    Raises:
        ModelFileError: The text is invalid or has an unsupported format.
    """
    return describe_sdf(text) if "<sdf" in text else describe_urdf(text)


def _spawn(bridge: Bridge, request: Any) -> dict[str, Any]:
    if not request.model_name:
        return failed("SpawnModel: Failure - the model has no name")
    if request.model_name in bridge.world.models:
        return failed("SpawnModel: Failure - entity already exists.")
    try:
        try:
            frame, _ = bridge.world.frame(request.reference_frame)
        except UnknownNameError:
            return failed("SpawnModel: Failure - reference reference_frame not found.")
        place = read_pose(request.initial_pose).after(frame)
        description = describe_text(request.model_xml)
        place = place_of(description.pose).after(place)
        bridge.add(Model(request.model_name, request.robot_namespace.strip("/"), description, place))
    except FrobsError as error:
        return failed(f"SpawnModel: Failure - {error}")
    return done("SpawnModel: Successfully spawned entity")


def _delete(bridge: Bridge, request: Any) -> dict[str, Any]:
    if request.model_name not in bridge.world.models:
        return failed(f"DeleteModel: model [{request.model_name}] does not exist")
    bridge.remove(request.model_name)
    return done("DeleteModel: successfully deleted model")


def _get_state(bridge: Bridge, request: Any) -> dict[str, Any]:
    from geometry_msgs.msg import Pose, Twist
    from std_msgs.msg import Header

    from frobs_ros.bridge.component import stamp

    world = bridge.world
    model = world.models.get(request.model_name)
    if model is None:
        return failed("GetModelState: model does not exist")
    try:
        frame, frame_motion = world.frame(request.relative_entity_name)
    except UnknownNameError:
        return failed(
            "GetModelState: reference relative_entity_name not found, did you forget to scope the body by model name?"
        )
    motion = model.motion()
    relative = Motion(motion.linear - frame_motion.linear, motion.angular - frame_motion.angular)
    return done(
        "GetModelState: got properties",
        header=Header(seq=world.steps % 2**32, stamp=stamp(world.time_ns), frame_id=request.relative_entity_name),
        pose=write_pose(model.place().seen_from(frame), Pose()),
        twist=write_twist(relative.turned(quat_conjugate(frame.quat_wxyz)), Twist()),
    )


def set_model_state(bridge: Bridge, state: Any) -> dict[str, Any]:
    """Teleport a model and set its velocity without changing joint positions."""
    world = bridge.world
    model = world.models.get(state.model_name)
    if model is None:
        return failed(f"SetModelState: model [{state.model_name}] does not exist")
    try:
        frame = world.frame(state.reference_frame)
    except UnknownNameError:
        return failed(f"SetModelState: specified reference frame entity [{state.reference_frame}] does not exist")
    world.put(model, *read_state(state, *frame))
    return done("SetModelState: set model state done")


def _get_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    if request.model_name == "ground_plane" and bridge.world.has_floor:
        shapes = {"canonical_body_name": "link", "body_names": ["link"], "geom_names": ["collision"]}
        return done("GetModelProperties: got properties", is_static=True, **shapes)
    model = bridge.world.models.get(request.model_name)
    if model is None:
        return failed("GetModelProperties: model does not exist")
    return done(
        "GetModelProperties: got properties",
        canonical_body_name=model.links[0] if model.links else "",
        body_names=list(model.links),
        geom_names=list(model.shapes),
        joint_names=list(model.all_joints),
        is_static=model.is_static,
    )


def _set_configuration(bridge: Bridge, request: Any) -> dict[str, Any]:
    model = bridge.world.models.get(request.model_name)
    if model is None:
        return failed(f"SetModelConfiguration: model [{request.model_name}] does not exist")
    if len(request.joint_names) != len(request.joint_positions):
        return failed("SetModelConfiguration: joint name and position list have different lengths")
    if not np.isfinite(request.joint_positions).all():
        raise ConfigurationError("a joint position is not finite.")
    for name in request.joint_names:
        if name.rpartition("::")[2] not in model.joints:
            raise UnknownNameError(f"actuated joint of '{model.name}'", name, model.joints)
    if model.robot is not None:
        positions = model.robot.joint_positions.copy()
        for name, position in zip(request.joint_names, request.joint_positions, strict=True):
            positions[0, model.joints[name.rpartition("::")[2]]] = position
        model.robot.write_joint_state(positions)
        for name in request.joint_names:  # otherwise, joints without a controller would return to their old targets
            joint = model.joints[name.rpartition("::")[2]]
            model.joint_targets.set_mode(joint, model.joint_targets.modes[joint], model.robot)
    return done("SetModelConfiguration: success")
