"""Inverse kinematics that finds one posture for a tool pose."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.models import joint_path
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnsuitableRobotError
from frobs_core.util.rotations import quat_difference
from frobs_core.util.validation import numbers

_SEEDS = 64
_ITERATIONS = 100
_DAMPING = 0.05  # [m/rad] damping of the least-squares problem
_PROBE = 1e-6  # [rad or m] finite-difference step for the Jacobian
_LONGEST = 0.3  # [rad or m] maximum joint motion per iteration
_NEAR = 1e-4  # [m, rad] maximum pose error of a solution
_CLEARANCE = 0.03  # [m] minimum height above the floor of each link frame beyond the second joint


def posture_at(robot: RobotHandle, pos: Floats, quat_wxyz: Floats) -> Floats:
    """Find joint positions near home that bring the tool center point to a pose.

    The search uses damped least squares, starting from the home position and from random postures. Joints that do not
    move the tool stay at home.

    Args:
        robot: Handle of an arm.
        pos: Target position in the world frame, (3,) [m].
        quat_wxyz: Target orientation in the world frame, scalar first, (4,).

    Returns:
        The joint positions, (dof,) [rad or m].

    Raises:
        UnsuitableRobotError: No posture was found.
    """
    low, high, home = robot.position_lower[0], robot.position_upper[0], robot.home[0]
    path = joint_path(robot.model, robot.frame_name("tcp"))
    moving = np.array([joint in {each.name for each in path} for joint in robot.joint_names])
    low, high = np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
    random = np.random.default_rng(0).uniform(low, high, (_SEEDS, robot.dof))
    joints = np.where(moving, np.concatenate([home[None], random]), home)  # (seeds, dof)
    for _ in range(_ITERATIONS):
        error = _error(robot, joints, pos, quat_wxyz)
        jacobian = _jacobian(robot, joints) * moving
        gram = np.einsum("nij,nkj->nik", jacobian, jacobian) + _DAMPING**2 * np.eye(6)
        step = np.einsum("nij,ni->nj", jacobian, np.linalg.solve(gram, error[:, :, None])[:, :, 0])
        joints = np.clip(joints + np.clip(step, -_LONGEST, _LONGEST), low, high)
    error = np.abs(_error(robot, joints, pos, quat_wxyz)).max(axis=1)
    links = [joint.child for joint in path[2:]]
    heights = np.stack([robot.planned_frame_pose(link, joints)[0][:, 2] for link in links] or [pos[None, 2]])
    usable = (error < _NEAR) & (heights.min(axis=0) > min(_CLEARANCE, pos[2] - 1e-3))
    if not usable.any():
        raise UnsuitableRobotError(
            robot.robot.name,
            f"cannot reach {numbers(pos)} m with its tool '{robot.tcp}' pointing down; choose another working area "
            "with center= and area=.",
        )
    far = ((joints - home) ** 2).sum(axis=1)
    return np.asarray(joints[np.argmin(np.where(usable, far, np.inf))])


def _error(robot: RobotHandle, joint_positions: Floats, pos: Floats, quat_wxyz: Floats) -> Floats:
    """Return the translation and rotation from the tool's pose to the target pose, (n, 6) [m, rad]."""
    there, turned = robot.planned_frame_pose("tcp", joint_positions)
    return np.concatenate([pos - there, quat_difference(np.broadcast_to(quat_wxyz, turned.shape), turned)], axis=1)


def _jacobian(robot: RobotHandle, joint_positions: Floats) -> Floats:
    """Compute the tool's Jacobian by finite differences, (n, 6, dof)."""
    pos, quat = robot.planned_frame_pose("tcp", joint_positions)
    columns = []
    for joint in range(robot.dof):
        probed = joint_positions.copy()
        probed[:, joint] += _PROBE
        moved_pos, moved_quat = robot.planned_frame_pose("tcp", probed)
        columns.append(np.concatenate([moved_pos - pos, quat_difference(moved_quat, quat)], axis=1) / _PROBE)
    return np.stack(columns, axis=-1)
