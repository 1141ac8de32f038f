"""Joint limits that several controllers use."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import JointGroup
from frobs_core.models import JointType
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import MissingSettingError, UnsuitableRobotError


def position_range(owner: str, joints: JointGroup) -> tuple[Floats, Floats]:
    """Return finite position limits, with −π or π in place of each missing limit.

    Args:
        owner: Name of the controller, used in the error message.
        joints: The joints.

    Returns:
        The lower and upper limits, (num_envs, dof) [rad or m] each.

    Raises:
        ConfigurationError: A prismatic joint has no position limits.
    """
    bounded = np.isfinite(joints.position_lower) & np.isfinite(joints.position_upper)  # (num_envs, dof)
    for i, joint in enumerate(joints.joints):
        if joint.type is JointType.PRISMATIC and not bounded[:, i].all():
            raise UnsuitableRobotError(
                joints.robot.name,
                f"has no position limits for the prismatic joint '{joint.name}', so actions cannot be scaled; "
                "add limits to the model file, or use joint_delta_position.",
                owner,
            )
    lower = np.where(np.isfinite(joints.position_lower), joints.position_lower, -np.pi)
    upper = np.where(np.isfinite(joints.position_upper), joints.position_upper, np.pi)
    return lower, upper


def scale(owner: str, name: str, given: float | None, limit: Floats, joints: JointGroup, unit: str) -> Floats:
    """Return each joint's value for an action of 1: the joint's limit, but at most the user's value.

    Args:
        owner: Name of the controller, used in the error message.
        name: Name of the parameter.
        given: The user's value, or None to use only the joint limits.
        limit: Joint limits, (num_envs, dof), infinite where the model file does not define a limit.
        joints: The joints.
        unit: Unit of the values, used in the error message.

    Returns:
        The values, (num_envs, dof), all finite.

    Raises:
        ConfigurationError: A joint has no limit, and the user did not set a value.
    """
    largest = limit.copy() if given is None else np.minimum(limit, given)  # (num_envs, dof)
    unlimited = [joint for i, joint in enumerate(joints.joint_names) if not np.isfinite(largest[:, i]).all()]
    if unlimited:
        raise MissingSettingError(
            owner, name, f"the model file defines no limit for {', '.join(unlimited)}; set {name}=… [{unit}]"
        )
    return largest
