"""Robot limits used by several controllers."""

from __future__ import annotations

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import MissingSettingError, UnsuitableRobotError
from frobs_core.interfaces import JointGroup
from frobs_core.models import JointType


def position_range(owner: str, joints: JointGroup) -> tuple[Floats, Floats]:
    """Return finite position limits; continuous joints use [−π, π].

    Args:
        owner: Name of the controller, for the error message.
        joints: The joints.

    Returns:
        lower and upper, (num_envs, dof) [rad or m] each.

    Raises:
        ConfigurationError: A prismatic joint has no limits.
    """
    bounded = np.isfinite(joints.position_lower) & np.isfinite(joints.position_upper)  # (num_envs, dof)
    for i, joint in enumerate(joints.joints):
        if joint.type is JointType.PRISMATIC and not bounded[:, i].all():
            raise UnsuitableRobotError(
                joints.robot.name,
                f"has no position limits for the prismatic joint '{joint.name}', to which actions are scaled; "
                "add limits to the model file, or use joint_delta_position.",
                owner,
            )
    lower = np.where(np.isfinite(joints.position_lower), joints.position_lower, -np.pi)
    upper = np.where(np.isfinite(joints.position_upper), joints.position_upper, np.pi)
    return lower, upper


def scale(owner: str, name: str, given: float | None, limit: Floats, joints: JointGroup, unit: str) -> Floats:
    """Return each joint's value for an action of 1: its limit, but at most the user's value.

    Args:
        owner: Name of the controller, for the error message.
        name: Name of the parameter.
        given: The user's value, or None to use only the limits.
        limit: (num_envs, dof); infinite if the model file does not define one.
        joints: The joints.
        unit: Unit, for the error message.

    Returns:
        (num_envs, dof), finite.

    Raises:
        ConfigurationError: A joint has no limit, and the user did not set a value.
    """
    found = limit.copy() if given is None else np.minimum(limit, given)  # (num_envs, dof)
    unlimited = [joint for i, joint in enumerate(joints.joint_names) if not np.isfinite(found[:, i]).all()]
    if unlimited:
        raise MissingSettingError(
            owner, name, f"the model file has no limit for {', '.join(unlimited)}; set {name}=… [{unit}]"
        )
    return found
