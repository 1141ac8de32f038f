"""Gains of joint drives, and default home positions, tool center points and drive gains of robots."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from frobs_core.models.kinematics import joint_path, outward, poses_by_link
from frobs_core.models.load import find_reader, is_model_file
from frobs_core.models.model import Joint, JointType, RobotModel
from frobs_core.models.solids import inertia_matrix
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, check_name
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import matrix_from_quat, quat_rotate

BANDWIDTH = 10.0
"""Default bandwidth of the drives [Hz]."""

TOOL_NAMES = ("tool0", "tcp", "tool", "ee_link", "end_effector", "ee", "hand_tcp", "tool_link", "flange", "grasp")
"""Common names of tool frames, most common first."""

_POSTURES = 256
_SATURATING_ERROR = (0.5, 0.05)  # [rad], [m]
_WEAK = 0.4  # minimum fraction of the bandwidth for a drive with a low effort limit
_LEAST_INERTIA = 1e-3  # [kg·m²] minimum, so that a drive with almost no load can still overcome friction
_LEAST_MASS = 0.1  # [kg] minimum
_GRAVITY = (0.0, 0.0, -9.81)  # [m/s²]


@dataclass(frozen=True, kw_only=True)
class DriveGains:
    """Gains of the drive law: one number for all joints, or a mapping from joint names to numbers.

    Attributes:
        stiffness: Kp [N·m/rad or N/m]
        damping: Kd [N·m·s/rad or N·s/m]
    """

    stiffness: float | Mapping[str, float]
    damping: float | Mapping[str, float]

    def of(self, joint: str) -> tuple[float, float]:
        """Return (Kp, Kd) for a joint. Joints missing from a mapping have 0."""

        def pick(gain: float | Mapping[str, float]) -> float:
            return gain.get(joint, 0.0) if isinstance(gain, Mapping) else gain

        return pick(self.stiffness), pick(self.damping)


def home_positions(model: RobotModel, home: Mapping[str, float]) -> Floats:
    """Return the home configuration.

    Args:
        model: Model of the robot.
        home: Positions by joint name [rad or m]. Omitted joints rest at 0, or at the middle of their limits if 0 is
            outside the limits.

    Returns:
        (dof,) [rad or m]

    Raises:
        UnknownNameError: A name does not belong to an actuated joint.
        ConfigurationError: A position is outside the joint's limits or not finite.
    """
    for name in home:
        check_name(f"actuated joint of '{model.name}'", name, model.joint_names)
    positions = np.zeros(len(model.actuated_joints))
    for i, joint in enumerate(model.actuated_joints):
        low, high = joint.limits.lower, joint.limits.upper
        rest = 0.0 if low <= 0.0 <= high else _middle(low, high)
        positions[i] = home.get(joint.name, rest)
        if not (low <= positions[i] <= high and math.isfinite(positions[i])):
            raise ParameterValueError(
                f"home of joint '{joint.name}'", positions[i], f"inside its limits [{low:g}, {high:g}]"
            )
    return positions


def _middle(low: float, high: float) -> float:
    """Return the middle of an interval, or its finite end if the interval is unbounded on one side."""
    if math.isinf(low):
        return high
    return low if math.isinf(high) else 0.5 * (low + high)


def default_tcp(model: RobotModel, finger_joints: Sequence[str] = ()) -> str:
    """Return the default tool center point.

    The default is the last link of the longest kinematic chain that is not a finger of a gripper. Chains are compared
    by their number of actuated joints, then by their number of joints, then by their order in the file. Among links
    that are moved by the same number of actuated joints, a link with a common tool name (``TOOL_NAMES``, ignoring
    prefix and case) takes precedence.

    Args:
        model: Model of the robot.
        finger_joints: Joints of the gripper, if they are known. Otherwise, fingers are found in the model.
    """
    moving, fingers = set(model.joint_names), ()
    if is_model_file(model.path):
        fingers = find_reader(model.path).finger_links(model, finger_joints)
    best: tuple[tuple[int, int, int], str] | None = None
    for link in model.links:
        if link.name in fingers:
            continue
        path = joint_path(model, link.name)
        actuated = sum(joint.name in moving for joint in path)
        rank = (actuated, usual_rank(link.name), len(path))
        if best is None or rank > best[0]:
            best = (rank, link.name)
    assert best is not None  # every model has at least one link
    return best[1]


def usual_rank(link: str) -> int:
    """Return the rank of a link's name among the tool names, or 0 if the link does not have a tool name.

    The most common tool name has the highest rank.
    """
    return next((len(TOOL_NAMES) - i for i, name in enumerate(TOOL_NAMES) if _is_named(link, name)), 0)


def _is_named(link: str, name: str) -> bool:
    link = link.lower()
    return link == name or link.endswith((f"_{name}", f"/{name}", f"-{name}"))


def default_gains(model: RobotModel, home_positions: npt.ArrayLike, bandwidth_hz: float = BANDWIDTH) -> DriveGains:
    """Return drive gains that make each joint at least critically damped if it moves alone.

    The gains are Kp = I·ω² and Kd = 2·I·ω, with ω = 2π·bandwidth. I is the largest inertia that the joint moves, over
    the home position and many other postures within the limits. The joint is critically damped at this inertia and
    overdamped at smaller inertias. I includes the armatures of the model
    file, but neither those of a robot's description nor the coupling between joints.

    A drive that reaches its effort limit brakes too late, and a drive whose Kd is large compared to the current inertia
    may chatter at the effort limit. Therefore, the bandwidth is reduced if a position error of 0.5 rad (or 5 cm) would
    require more than the effort limit. The bandwidth is reduced until this error requires exactly the effort limit, but
    not below 40 % of ``bandwidth_hz``.

    Args:
        model: Model of the robot.
        home_positions: (dof,) [rad or m]
        bandwidth_hz: Bandwidth of the drives [Hz].
    """
    home = np.asarray(home_positions, float)[None]
    largest = _inertias(model, np.concatenate([home, _postures(model)])).max(axis=0).tolist()
    stiffness, damping = {}, {}
    for joint, inertia in zip(model.actuated_joints, largest, strict=True):
        omega = _omega(joint, inertia, 2.0 * math.pi * bandwidth_hz)
        stiffness[joint.name] = inertia * omega**2
        damping[joint.name] = 2.0 * inertia * omega
    return DriveGains(stiffness=stiffness, damping=damping)


def _omega(joint: Joint, inertia: float, requested: float) -> float:
    """Return the bandwidth [rad/s] of a joint's drive, reduced if its effort limit is low."""
    error = _SATURATING_ERROR[joint.type == JointType.PRISMATIC]
    saturating = math.sqrt(joint.limits.effort / (inertia * error))
    return min(requested, max(saturating, _WEAK * requested))


def composite_inertia(model: RobotModel, joint_positions: npt.ArrayLike) -> dict[str, float]:
    """Return the inertia that each actuated joint moves while all other joints are held.

    Args:
        model: Model of the robot.
        joint_positions: (dof,) [rad or m]

    Returns:
        Inertias by joint name, with the armatures of the model file: for revolute joints, the inertia about the joint's
        axis [kg·m²], at least 10⁻³; for prismatic joints, the moved mass [kg], at least 0.1. The inertia of a mimic
        joint is multiplied by the square of its multiplier and added to the inertia of the joint that it follows.
    """
    row = _inertias(model, np.asarray(joint_positions, float)[None])[0]
    return dict(zip(model.joint_names, row.tolist(), strict=True))


def gravity_efforts(model: RobotModel, joint_positions: Floats, gravity: Sequence[float] | Floats = _GRAVITY) -> Floats:
    """Return the joint efforts that hold the robot against gravity while its root link is fixed.

    Args:
        model: Model of the robot.
        joint_positions: Positions of the actuated joints, (dof,) [rad or m].
        gravity: Gravity in the frame of the root link, (3,) [m/s²]. By default, the root link is upright.

    Returns:
        The efforts, (dof,) [N·m or N].
    """
    step = 1e-4 * np.eye(len(joint_positions))
    positions = np.concatenate([joint_positions + step, joint_positions - step])  # (2 dof, dof)
    energies = np.zeros(len(positions))
    for link in model.links:
        if link.inertial is not None:
            pos, quat = model.frame_pose(link.name, positions)
            center = pos + quat_rotate(quat, np.array(link.inertial.origin.pos))
            energies -= link.inertial.mass * (center * np.array(gravity)).sum(axis=1)
    above, below = np.split(energies, 2)
    efforts = (above - below) / 2e-4
    return np.where(np.abs(efforts) < 1e-9, 0.0, efforts)


def _postures(model: RobotModel) -> Floats:
    """Return a fixed set of joint positions within the limits, (n, dof).

    The positions cover at most one turn of a revolute joint, and at most ±1 m of a prismatic joint.
    """
    joints = model.actuated_joints
    span = [1.0 if joint.type == JointType.PRISMATIC else math.pi for joint in joints]
    low = np.array([max(joint.limits.lower, -s) for joint, s in zip(joints, span, strict=True)])
    high = np.array([min(joint.limits.upper, s) for joint, s in zip(joints, span, strict=True)])
    drawn = RandomSource(1).uniform("postures", np.minimum(low, high), high, (_POSTURES, len(joints)))
    return np.asarray(drawn[0])


def _inertias(model: RobotModel, joint_positions: Floats) -> Floats:
    """Return the inertia that each actuated joint moves, (n, dof), for joint positions (n, dof)."""
    n = len(joint_positions)
    joints = outward(model)
    poses = poses_by_link(model, joint_positions)
    # Sums over each link's subtree, relative to the root: mass, mass times position, inertia about the root's origin
    mass = {link.name: 0.0 for link in model.links}
    moment = {link.name: np.zeros((n, 3)) for link in model.links}
    inertia = {link.name: np.zeros((n, 3, 3)) for link in model.links}
    for link in model.links:
        if link.inertial is None:
            continue
        pos, quat = poses[link.name]
        centre = pos + quat_rotate(quat, np.array(link.inertial.origin.pos))
        rotation = matrix_from_quat(quat)
        turned = rotation @ inertia_matrix(link.inertial) @ np.swapaxes(rotation, -1, -2)
        mass[link.name] = link.inertial.mass
        moment[link.name] = link.inertial.mass * centre
        inertia[link.name] = turned + link.inertial.mass * _about_origin(centre)
    for joint in reversed(joints):
        mass[joint.parent] += mass[joint.child]
        moment[joint.parent] += moment[joint.child]
        inertia[joint.parent] += inertia[joint.child]
    result = np.zeros((n, len(model.actuated_joints)))
    columns = {name: i for i, name in enumerate(model.joint_names)}
    for joint in model.joints:
        leader = model.leader(joint)
        if leader is None:
            continue
        pos, quat = poses[joint.child]
        axis = quat_rotate(quat, np.array(joint.axis))  # moving the joint does not change its axis
        if joint.type == JointType.PRISMATIC:
            carried: Floats | float = mass[joint.child]
        else:
            below, total = moment[joint.child], mass[joint.child]
            carried = (
                (axis[:, None, :] * inertia[joint.child] * axis[:, :, None]).sum(axis=(1, 2))
                - 2.0 * ((pos * below).sum(axis=-1) - (axis * pos).sum(axis=-1) * (axis * below).sum(axis=-1))
                + total * ((pos * pos).sum(axis=-1) - (axis * pos).sum(axis=-1) ** 2)
            )
        result[:, columns[leader.joint]] += leader.multiplier**2 * (carried + joint.armature)
    least = [_LEAST_MASS if joint.type == JointType.PRISMATIC else _LEAST_INERTIA for joint in model.actuated_joints]
    return np.maximum(result, least)


def _about_origin(positions: Floats) -> Floats:
    """Return the inertia about the origin, (n, 3, 3) [m²], for a point mass of 1 kg at each position."""
    squares = (positions * positions).sum(axis=-1)[:, None, None] * np.eye(3)
    return np.asarray(squares - positions[:, :, None] * positions[:, None, :])
