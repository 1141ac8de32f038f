"""Services that spawn, delete, inspect and teleport models."""

from __future__ import annotations

import os
from functools import lru_cache
from typing import Any

import numpy as np

from frobs_core.util.errors import ConfigurationError, FrobsError, check_name
from frobs_core.util.rotations import quat_conjugate
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.component import stamp
from frobs_ros.bridge.model import Description, Model
from frobs_ros.bridge.poses import Motion, place_of, pose_message, read_pose, read_state, twist_message
from frobs_ros.bridge.sdf import describe_sdf
from frobs_ros.bridge.services.offer import Services, done, found
from frobs_ros.bridge.urdf import describe_urdf
from frobs_ros.messages.types import find_type

_PATHS = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "GAZEBO_MODEL_PATH", "HOME")
"""Environment variables that determine which files a model refers to."""


def describe_text(text: str) -> Description:
    """Parse a model from URDF, xacro or SDF text.

    Raises:
        ModelFileError: The text is invalid or has an unsupported format.
    """
    return _describe(text, tuple(os.environ.get(name, "") for name in _PATHS))


@lru_cache(maxsize=64)  # repeated spawns reuse the result unless the search paths change
def _describe(text: str, paths: tuple[str, ...]) -> Description:
    del paths
    return describe_sdf(text) if "<sdf" in text else describe_urdf(text)


def _spawn(bridge: Bridge, request: Any) -> dict[str, Any]:
    try:
        if not request.model_name:
            raise ConfigurationError("the model has no name")
        if request.model_name in bridge.world.models:
            raise ConfigurationError("entity already exists.")
        frame, _ = found(bridge.world.frame, request.reference_frame, "reference reference_frame not found.")
        place = read_pose(request.initial_pose).after(frame)
        description = describe_text(request.model_xml)
        place = place_of(description.pose).after(place)
        bridge.add(Model(request.model_name, request.robot_namespace.strip("/"), description, place))
    except FrobsError as error:
        raise ConfigurationError(f"Failure - {error}") from error
    return done("SpawnModel: Successfully spawned entity")


def _delete(bridge: Bridge, request: Any) -> dict[str, Any]:
    found(bridge.remove, request.model_name, f"model [{request.model_name}] does not exist")
    return done("DeleteModel: successfully deleted model")


def _get_state(bridge: Bridge, request: Any) -> dict[str, Any]:
    world = bridge.world
    model = found(world.model, request.model_name, "model does not exist")
    unknown = "reference relative_entity_name not found, did you forget to scope the body by model name?"
    frame, frame_motion = found(world.frame, request.relative_entity_name, unknown)
    motion = model.motion()
    relative = Motion(motion.linear - frame_motion.linear, motion.angular - frame_motion.angular)
    return done(
        "GetModelState: got properties",
        header=find_type("std_msgs/Header")(
            seq=world.steps % 2**32, stamp=stamp(world.time_ns), frame_id=request.relative_entity_name
        ),
        pose=pose_message(model.place().seen_from(frame)),
        twist=twist_message(relative.turned(quat_conjugate(frame.quat_wxyz))),
    )


def set_model_state(bridge: Bridge, state: Any) -> dict[str, Any]:
    """Teleport a model and set its velocity without changing joint positions."""
    world = bridge.world
    model = found(world.model, state.model_name, f"model [{state.model_name}] does not exist")
    unknown = f"specified reference frame entity [{state.reference_frame}] does not exist"
    frame = found(world.frame, state.reference_frame, unknown)
    world.put(model, *read_state(state, *frame))
    return done("SetModelState: set model state done")


def _get_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    if request.model_name == "ground_plane" and bridge.world.has_floor:
        shapes = {"canonical_body_name": "link", "body_names": ["link"], "geom_names": ["collision"]}
        return done("GetModelProperties: got properties", is_static=True, **shapes)
    model = found(bridge.world.model, request.model_name, "model does not exist")
    return done(
        "GetModelProperties: got properties",
        canonical_body_name=model.links[0] if model.links else "",
        body_names=list(model.links),
        geom_names=list(model.shapes),
        joint_names=list(model.all_joints),
        is_static=model.is_static,
    )


def _set_configuration(bridge: Bridge, request: Any) -> dict[str, Any]:
    model = found(bridge.world.model, request.model_name, f"model [{request.model_name}] does not exist")
    if len(request.joint_names) != len(request.joint_positions):
        raise ConfigurationError("joint name and position list have different lengths")
    if not np.isfinite(request.joint_positions).all():
        raise ConfigurationError("a joint position is not finite.")
    joints = [name.rpartition("::")[2] for name in request.joint_names]
    for joint in joints:
        check_name(f"actuated joint of '{model.name}'", joint, model.joints)
    if model.robot is not None:
        columns = [model.joints[joint] for joint in joints]
        positions = model.robot.joint_positions.copy()
        positions[0, columns] = request.joint_positions
        model.robot.write_joint_state(positions)
        for column in columns:  # otherwise, joints without a controller would return to their old targets
            model.joint_targets.set_mode(column, model.joint_targets.modes[column], model.robot)
    return done("SetModelConfiguration: success")


SERVICES: Services = {
    # In Gazebo, either service accepts both formats, and clients rely on this behavior.
    "spawn_urdf_model": ("SpawnModel", _spawn),
    "spawn_sdf_model": ("SpawnModel", _spawn),
    "delete_model": ("DeleteModel", _delete),
    "get_model_state": ("GetModelState", _get_state),
    "set_model_state": (
        "SetModelState",
        lambda bridge, request: set_model_state(bridge, request.model_state),
    ),
    "get_model_properties": ("GetModelProperties", _get_properties),
    "set_model_configuration": ("SetModelConfiguration", _set_configuration),
}
