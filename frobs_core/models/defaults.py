"""What a robot's description may leave out: home, tool frame and drive gains."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError, UnknownNameError
from frobs_core.models.inertia import inertia_matrix
from frobs_core.models.kinematics import forward_kinematics, joint_path
from frobs_core.models.model import JointType, RobotModel
from frobs_core.rotations import matrix_from_quat, quat_rotate

if TYPE_CHECKING:
    from frobs_core.interfaces.robot import DriveGains

BANDWIDTH = 10.0
"""[Hz] of the drives whose gains nobody chose."""

TOOL_NAMES = ("tool0", "tcp", "tool", "ee_link", "end_effector", "ee", "hand_tcp", "tool_link", "flange", "grasp")
"""Usual names of a tool frame, the likeliest first."""

_LEAST_INERTIA = 1e-3  # [kg·m²]: a joint that turns next to nothing still holds against friction
_LEAST_MASS = 0.1  # [kg]


def home_positions(model: RobotModel, home: Mapping[str, float]) -> Floats:
    """Return the rest configuration.

    Args:
        model: The robot.
        home: Position by joint name [rad or m]. A joint that is left out rests at 0, or at the middle of its limits
            where 0 is outside of them.

    Returns:
        (dof,) [rad or m]

    Raises:
        UnknownNameError: A name is no actuated joint's.
        ConfigurationError: A position is outside of its joint's limits, or not finite.
    """
    for name in home:
        if name not in model.joint_names:
            raise UnknownNameError(f"actuated joint of '{model.name}'", name, model.joint_names)
    positions = np.zeros(len(model.actuated_joints))
    for i, joint in enumerate(model.actuated_joints):
        low, high = joint.limits.lower, joint.limits.upper
        rest = 0.0 if low <= 0.0 <= high else _middle(low, high)
        positions[i] = home.get(joint.name, rest)
        if not (low <= positions[i] <= high and math.isfinite(positions[i])):
            raise ConfigurationError(
                f"home of joint '{joint.name}' is {positions[i]:g}, outside of its limits [{low:g}, {high:g}]."
            )
    return positions


def _middle(low: float, high: float) -> float:
    """Return the middle of an interval that may be open at one end."""
    if math.isinf(low):
        return high
    return low if math.isinf(high) else 0.5 * (low + high)


def default_tcp(model: RobotModel) -> str:
    """Return the link that a task talks about when nobody says which.

    It is the last link of the longest chain, where the length is the number of actuated joints, then of joints, then
    the earlier in the file. A link with a usual name (``TOOL_NAMES``, whatever its prefix and case) comes
    before all others that as many actuated joints move.
    """
    moving = set(model.joint_names)
    best: tuple[tuple[int, int, int], str] | None = None
    for link in model.links:
        path = joint_path(model, link.name)
        actuated = sum(joint.name in moving for joint in path)
        rank = (actuated, usual_rank(link.name), len(path))
        if best is None or rank > best[0]:
            best = (rank, link.name)
    assert best is not None  # a model has at least one link
    return best[1]


def usual_rank(link: str) -> int:
    """Return how usual a link's name is for a tool: 0 for not at all."""
    return next((len(TOOL_NAMES) - i for i, name in enumerate(TOOL_NAMES) if _is_named(link, name)), 0)


def _is_named(link: str, name: str) -> bool:
    link = link.lower()
    return link == name or link.endswith((f"_{name}", f"/{name}", f"-{name}"))


def default_gains(model: RobotModel, home_positions: npt.ArrayLike, bandwidth_hz: float = BANDWIDTH) -> DriveGains:
    """Return gains of the drive law that are critically damped at home.

    With I the inertia about the joint of all that it carries at home and ω = 2π·bandwidth, Kp = I·ω² and
    Kd = 2·I·ω. (What is coupled between joints, and armatures, are not in I.)

    Args:
        model: The robot.
        home_positions: (dof,) [rad or m]
        bandwidth_hz: [Hz]
    """
    from frobs_core.interfaces.robot import DriveGains  # interfaces.robot's package imports the models

    omega = 2.0 * math.pi * bandwidth_hz
    inertia = composite_inertia(model, home_positions)
    return DriveGains(
        stiffness={name: value * omega**2 for name, value in inertia.items()},
        damping={name: 2.0 * value * omega for name, value in inertia.items()},
    )


def composite_inertia(model: RobotModel, joint_positions: npt.ArrayLike) -> dict[str, float]:
    """Return what each actuated joint has to move, with all other joints held.

    Args:
        model: The robot.
        joint_positions: (dof,) [rad or m]

    Returns:
        By joint name, [kg·m²] about its axis, at least 10⁻³; [kg] for a prismatic joint, at least 0.1.
    """
    positions = np.asarray(joint_positions, float)[None]
    paths = {link.name: {joint.name for joint in joint_path(model, link.name)} for link in model.links}
    poses = {link.name: forward_kinematics(model, link.name, positions) for link in model.links}
    result = {}
    for joint in model.actuated_joints:
        pos, quat = (array[0] for array in poses[joint.child])
        axis = quat_rotate(quat, np.array(joint.axis))  # the motion leaves it where it is
        total = 0.0
        for link in model.links:
            if link.inertial is None or joint.name not in paths[link.name]:
                continue
            if joint.type == JointType.PRISMATIC:
                total += link.inertial.mass
                continue
            link_pos, link_quat = (array[0] for array in poses[link.name])
            arm = np.cross(axis, link_pos + quat_rotate(link_quat, np.array(link.inertial.origin.pos)) - pos)
            rotation = matrix_from_quat(link_quat)
            moments = rotation @ inertia_matrix(link.inertial) @ rotation.T
            total += float(axis @ moments @ axis + link.inertial.mass * (arm @ arm))
        least = _LEAST_MASS if joint.type == JointType.PRISMATIC else _LEAST_INERTIA
        result[joint.name] = max(total, least)
    return result
