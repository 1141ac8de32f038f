"""Reads a robot's URDF, SRDF and joint limits from MoveIt's parameters."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.models import JointLimits, RobotModel, load_model
from frobs_core.util.arrays import Floats
from frobs_rl_compat.moveit.errors import MoveItCommanderException, check_known
from frobs_rl_compat.moveit.joints import JointStates
from frobs_rl_compat.moveit.poses import IDENTITY
from frobs_rl_compat.moveit.semantics import Group, Semantics, read_srdf

_SCALING = 0.1  # MoveIt's default


@dataclass(frozen=True)
class RobotDescription:
    """A robot described by MoveIt's parameters."""

    model: RobotModel  # with the limits from ``joint_limits.yaml``
    semantics: Semantics
    max_acceleration: Mapping[str, float]  # [rad/s² or m/s²] limits from ``joint_limits.yaml``, by joint name
    velocity_scaling: float  # default fraction of the velocity limits
    acceleration_scaling: float  # default fraction of the acceleration limits

    def group(self, name: str) -> Group:
        """Return a group of joints."""
        check_known(f"robot '{self.model.name}'", "group", name, self.semantics.groups)
        return self.semantics.groups[name]

    def link_pose(self, link: str, positions: Mapping[str, float]) -> Floats:
        """Return the pose (7,) of a link in the planning frame at given positions of all joints [rad or m]."""
        pos, quat = self.model.frame_pose(link, np.array([[positions[name] for name in self.model.joint_names]]))
        return np.concatenate([pos[0], quat[0]])

    def frame_pose(self, frame: str, states: JointStates) -> Floats:
        """Return the current pose (7,) of a link or of the planning frame (also named ``""``) in the planning frame."""
        frame, planning_frame = frame.removeprefix("/"), self.semantics.planning_frame
        if frame in ("", planning_frame, self.model.root):
            return IDENTITY
        if frame not in {link.name for link in self.model.links}:
            raise MoveItCommanderException(
                f"the frame '{frame}' is neither the planning frame '{planning_frame}' nor a link of the robot."
            )
        return self.link_pose(frame, states.current(self.model.joint_names))


def read_description(parameter: str = "robot_description", namespace: str = "") -> RobotDescription:
    """Read a robot from the parameter server.

    Args:
        parameter: Name of the parameter that contains the URDF. The parameter ``<parameter>_semantic`` contains the
            SRDF, and ``<parameter>_planning`` contains the joint limits.
        namespace: Namespace of the parameters. Defaults to the namespace of this node.
    """
    import rospy

    name = rospy.resolve_name(f"{namespace.rstrip('/')}/{parameter}" if namespace else parameter)
    texts = []
    for required, file in ((name, "URDF"), (f"{name}_semantic", "SRDF")):
        if not rospy.has_param(required):
            raise MoveItCommanderException(
                f"the parameter {required} does not exist; load the robot's {file} into it before you use "
                "moveit_commander."
            )
        texts.append(str(rospy.get_param(required)))
    urdf, srdf = texts
    return describe(urdf, srdf, rospy.get_param(f"{name}_planning", {}), source=name)


def describe(urdf: str, srdf: str, planning: Mapping[str, Any], source: str = "robot_description") -> RobotDescription:
    """Create a robot description from a URDF, an SRDF and the contents of ``joint_limits.yaml``."""
    limits: Mapping[str, Any] = planning.get("joint_limits", {})
    model = _read_urdf(urdf)
    joints = tuple(replace(joint, limits=_limits(joint.limits, limits.get(joint.name, {}))) for joint in model.joints)
    model = replace(model, joints=joints)
    return RobotDescription(
        model=model,
        semantics=read_srdf(srdf, model, f"{source}_semantic"),
        max_acceleration={
            name: float(limit["max_acceleration"])
            for name, limit in limits.items()
            if name in model.joint_names and limit.get("has_acceleration_limits") and limit.get("max_acceleration")
        },
        velocity_scaling=float(planning.get("default_velocity_scaling_factor", _SCALING)),
        acceleration_scaling=float(planning.get("default_acceleration_scaling_factor", _SCALING)),
    )


@lru_cache(maxsize=8)
def _read_urdf(text: str) -> RobotModel:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "robot_description.urdf")
        file.write_text(text)
        return load_model(file)


def _limits(limits: JointLimits, changes: Mapping[str, Any]) -> JointLimits:
    """Return a joint's limits after applying the changes from ``joint_limits.yaml``."""
    if changes.get("has_position_limits"):
        lower, upper = changes.get("min_position", limits.lower), changes.get("max_position", limits.upper)
        limits = replace(limits, lower=float(lower), upper=float(upper))
    if changes.get("has_velocity_limits") and math.isfinite(float(changes.get("max_velocity", math.inf))):
        limits = replace(limits, velocity=float(changes["max_velocity"]))
    return limits
