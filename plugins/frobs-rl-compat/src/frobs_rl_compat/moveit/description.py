"""Reads a robot's URDF, SRDF and joint limits from MoveIt's parameters."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from frobs_core.models import JointLimits, RobotModel, load_model
from frobs_rl_compat.moveit.errors import MoveItCommanderException
from frobs_rl_compat.moveit.semantics import Group, Semantics, read_srdf

_SCALING = 0.1  # MoveIt's default


@dataclass(frozen=True)
class RobotDescription:
    """A robot described by MoveIt's parameters.

    Attributes:
        model: The robot model with the limits from ``joint_limits.yaml``.
        semantics: The contents of the robot's SRDF.
        max_acceleration: Acceleration limits from ``joint_limits.yaml`` [rad/s² or m/s²], by joint name. Joints without
            an acceleration limit are omitted.
        velocity_scaling: Default velocity scaling factor, as a fraction of the velocity limits.
        acceleration_scaling: Default acceleration scaling factor, as a fraction of the acceleration limits.
    """

    model: RobotModel
    semantics: Semantics
    max_acceleration: Mapping[str, float]
    velocity_scaling: float
    acceleration_scaling: float

    def group(self, name: str) -> Group:
        """Return a group of joints.

        Raises:
            MoveItCommanderException: The group does not exist.
        """
        groups = self.semantics.groups
        if name not in groups:
            raise MoveItCommanderException(
                f"the robot '{self.model.name}' has no group '{name}'; the groups in the SRDF are: "
                f"{', '.join(groups) or 'none'}."
            )
        return groups[name]


def read_description(parameter: str = "robot_description", namespace: str = "") -> RobotDescription:
    """Read a robot from the parameter server.

    Args:
        parameter: Name of the parameter that contains the URDF. The parameter ``<parameter>_semantic`` contains the
            SRDF, and ``<parameter>_planning`` contains the joint limits.
        namespace: Namespace of the parameters. Defaults to the namespace of this node.

    Raises:
        MoveItCommanderException: A parameter is missing.
        ModelFileError: The URDF or the SRDF is invalid.
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
    """Create a robot description from a URDF, an SRDF and the contents of ``joint_limits.yaml``.

    Raises:
        ModelFileError: The URDF or the SRDF is invalid.
    """
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
