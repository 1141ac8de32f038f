"""What several controllers read from a robot."""

from __future__ import annotations

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import MissingSettingError, UnsuitableRobotError
from frobs_core.interfaces import JointGroup
from frobs_core.models import JointType


def position_range(owner: str, joints: JointGroup) -> tuple[Floats, Floats]:
    """Return finite position limits; a continuous joint turns in [−π, π].

    Args:
        owner: The controller's name, for the message.
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
                f"gives the prismatic joint '{joint.name}' no position limits to scale to; "
                "add limits to the model file, or use joint_delta_position.",
                owner,
            )
    lower = np.where(np.isfinite(joints.position_lower), joints.position_lower, -np.pi)
    upper = np.where(np.isfinite(joints.position_upper), joints.position_upper, np.pi)
    return lower, upper


def scale(owner: str, name: str, given: float | None, limit: Floats, joints: JointGroup, unit: str) -> Floats:
    """Return what an action of 1 means for each joint: its limit, and no more than what the user gave.

    Args:
        owner: The controller's name, for the message.
        name: The parameter's.
        given: What the user gave; None: the limits alone.
        limit: (num_envs, dof); infinite where the model file gives none.
        joints: The joints.
        unit: For the message.

    Returns:
        (num_envs, dof), finite.

    Raises:
        ConfigurationError: A joint has no limit, and the user gave none.
    """
    found = limit.copy() if given is None else np.minimum(limit, given)  # (num_envs, dof)
    unlimited = [joint for i, joint in enumerate(joints.joint_names) if not np.isfinite(found[:, i]).all()]
    if unlimited:
        raise MissingSettingError(
            owner, name, f"the model file gives no limit for {', '.join(unlimited)}, so set {name}=… [{unit}]"
        )
    return found
