"""Forward kinematics: poses of a robot's links for batches of joint positions, computed without an engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from frobs_core.models.model import Joint, JointType, Pose, RobotModel
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, check_name
from frobs_core.util.rotations import matrix_from_quat, quat_conjugate, quat_from_matrix, quat_multiply, quat_rotate

MOVING = (JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC)
"""Types of joints with one degree of freedom."""


@dataclass(frozen=True, eq=False)
class Chain:
    """Moving joints between the root and a link, with all fixed transforms merged into the joints.

    Each joint's frame is rotated so that the joint moves about or along z. An array (7, n) of n points [m] and n
    quaternions is propagated from the tip to the root. Each joint requires only three products of arrays of length n.

    Attributes:
        columns: Index of the actuated joint that each of the k joints follows, (k,).
        multipliers: Multipliers of mimic joints, or 1 for other joints, (k, 1).
        offsets: Offsets of mimic joints, (k, 1) [rad or m].
        turns: 1 for each revolute joint and 0 for each prismatic joint, (k, 1).
        slides: Whether each of the k joints is prismatic.
        frames: Matrices that rotate points and quaternions by the rotations of the joint frames, (k, 7, 7, 1).
        origins: Origins of the joint frames [m], padded with zeros, (k, 7, 1).
        tip: Pose of the link in the frame of the last moving joint, (7, 1).
    """

    columns: npt.NDArray[np.intp]
    multipliers: Floats
    offsets: Floats
    turns: Floats
    slides: tuple[bool, ...]
    frames: Floats
    origins: Floats
    tip: Floats


_SWAP = np.array([1, 0, 2, 6, 5, 4, 3])  # a rotation about z mixes component i with component _SWAP[i]


def forward_kinematics(model: RobotModel, frame: str, joint_positions: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Return the pose of a link relative to the root link.

    Mimic joints follow their leaders. Floating, planar and passive joints stay at zero. Row *i* of a result depends
    only on row *i* of the joint positions, and the results are bit-identical for every n.

    Args:
        model: Model of the robot.
        frame: Name of a link.
        joint_positions: Joint positions, (n, dof) [rad or m], in the order of ``model.joint_names``. Joint limits are
            ignored.

    Returns:
        pos (n, 3) [m] and the unit quaternions quat_wxyz (n, 4). The quaternions vary continuously with the joint
        positions, without sign flips.

    Raises:
        UnknownNameError: The link does not exist.
        ConfigurationError: The joint positions do not have the shape (n, dof).
    """
    chain = model._chains.get(frame)
    if chain is None:
        chain = model._chains.setdefault(frame, make_chain(model, frame))
    positions = np.asarray(joint_positions, float)
    _check_joint_positions(model, positions)
    q = positions.T.take(chain.columns, axis=0) * chain.multipliers + chain.offsets  # (k, n)
    cosines, sines = _mixing(q * chain.turns)
    state = np.repeat(chain.tip, len(positions), axis=1)  # (7, n)
    for j in range(len(q) - 1, -1, -1):
        state = cosines[j] * state + sines[j] * state.take(_SWAP, axis=0)
        if chain.slides[j]:
            state[2] += q[j]
        state = (chain.frames[j] * state).sum(axis=1) + chain.origins[j]
    return state[:3].T.copy(), state[3:].T.copy()


def link_poses(model: RobotModel, joint_positions: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Return the poses of all links relative to the root link, in the order of ``model.links``.

    This is faster than :func:`forward_kinematics` for each link. Floating, planar and passive joints stay at zero.

    Args:
        model: Model of the robot.
        joint_positions: Joint positions, (n, dof) [rad or m], in the order of ``model.joint_names``. Joint limits are
            ignored.

    Returns:
        pos (n, links, 3) [m] and the unit quaternions quat_wxyz (n, links, 4).

    Raises:
        ConfigurationError: The joint positions do not have the shape (n, dof).
    """
    poses = poses_by_link(model, np.asarray(joint_positions, float))
    pos, quat = (np.stack([poses[link.name][i] for link in model.links], axis=1) for i in (0, 1))
    return pos, quat


def poses_by_link(model: RobotModel, joint_positions: Floats) -> dict[str, tuple[Floats, Floats]]:
    """Return pos (n, 3) [m] and quat_wxyz (n, 4) of each link, by name. For the arguments, see :func:`link_poses`."""
    _check_joint_positions(model, joint_positions)
    n = len(joint_positions)
    poses = {model.root: (np.zeros((n, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)))}
    for joint in outward(model):
        leader, position = model.leader(joint), np.zeros((n, 1))
        if leader is not None:
            column = model.joint_names.index(leader.joint)
            position = leader.multiplier * joint_positions[:, column : column + 1] + leader.offset
        poses[joint.child] = moved(joint, *poses[joint.parent], position)
    return poses


def _check_joint_positions(model: RobotModel, positions: Floats) -> None:
    dof = len(model.actuated_joints)
    if positions.ndim != 2 or positions.shape[1] != dof:
        raise ParameterValueError(
            "shape of joint_positions",
            positions.shape,
            f"(n, {dof}), with one column for each of the joints {model.joint_names}",
            f"'{model.name}'",
        )


def _mixing(angle: Floats) -> tuple[Floats, Floats]:
    """Return the factors, (k, 7, n) each, that multiply ``state`` and ``state[_SWAP]`` in a rotation about z."""
    cosines = np.empty((len(angle), 7, angle.shape[1]))
    sines = np.empty_like(cosines)
    half = 0.5 * angle
    cosines[:, :2] = np.cos(angle)[:, None]
    cosines[:, 2] = 1.0
    cosines[:, 3:] = np.cos(half)[:, None]
    sines[:, 1] = np.sin(angle)
    sines[:, 0] = -sines[:, 1]
    sines[:, 2] = 0.0
    sines[:, 5:] = np.sin(half)[:, None]
    sines[:, 3:5] = -sines[:, 5:]
    return cosines, sines


def make_chain(model: RobotModel, frame: str) -> Chain:
    """Precompute the constants of the path from the root to a link."""
    links = [link.name for link in model.links]
    check_name("link", frame, links)
    columns, multipliers, offsets, slides, frames, origins = [], [], [], [], [], []
    state = pose_array(Pose())  # fixed transform since the last moving joint
    for joint in joint_path(model, frame):
        state = compose(state, pose_array(joint.origin))
        leader = model.leader(joint)
        if leader is None:
            continue
        align = np.concatenate([np.zeros(3), _turn_z_to(np.array(joint.axis))])
        columns.append(model.joint_names.index(leader.joint))
        multipliers.append(leader.multiplier)
        offsets.append(leader.offset)
        slides.append(joint.type == JointType.PRISMATIC)
        aligned = compose(state, align)
        block = np.zeros((7, 7))
        block[:3, :3] = matrix_from_quat(aligned[3:])
        block[3:, 3:] = _left_product(aligned[3:])
        frames.append(block)
        origins.append([*aligned[:3], 0.0, 0.0, 0.0, 0.0])
        state = np.concatenate([np.zeros(3), quat_conjugate(align[3:])])
    k = len(columns)
    return Chain(
        columns=np.array(columns, dtype=np.intp),
        multipliers=np.array(multipliers, dtype=float).reshape(k, 1),
        offsets=np.array(offsets, dtype=float).reshape(k, 1),
        turns=1.0 - np.array(slides, dtype=float).reshape(k, 1),
        slides=tuple(slides),
        frames=np.array(frames, dtype=float).reshape(k, 7, 7, 1),
        origins=np.array(origins, dtype=float).reshape(k, 7, 1),
        tip=state[:, None],
    )


def pose_array(pose: Pose) -> Floats:
    """Return a pose as an array (7,) of position [m] and quat_wxyz."""
    return np.array([*pose.pos, *pose.quat_wxyz])


def pose_from_array(array: Floats) -> Pose:
    """Convert an ``array`` (7,) from :func:`pose_array` to a pose."""
    x, y, z, w, i, j, k = array.tolist()
    return Pose((x, y, z), (w, i, j, k))


def compose(outer: Floats, inner: Floats) -> Floats:
    """Return the product of two poses (7,) of position [m] and quat_wxyz, where ``inner`` is relative to ``outer``."""
    pos = outer[:3] + quat_rotate(outer[3:], inner[:3])
    return np.concatenate([pos, quat_multiply(outer[3:], inner[3:])])


def _turn_z_to(axis: Floats) -> Floats:
    """Return a quaternion that rotates the z axis onto a unit vector. The result is exact for coordinate axes."""
    helper = np.eye(3)[(int(np.argmax(np.abs(axis))) + 2) % 3]
    x = np.cross(helper, axis)
    x /= np.sqrt((x * x).sum())
    return quat_from_matrix(np.stack([x, np.cross(axis, x), axis], axis=-1))


def joint_path(model: RobotModel, frame: str) -> list[Joint]:
    """Return the joints on the path from the root to the link ``frame``, in order."""
    above = {joint.child: joint for joint in model.joints}
    path = []
    while frame in above:
        path.append(above[frame])
        frame = above[frame].parent
    return path[::-1]


def moved(joint: Joint, pos: Floats, quat: Floats, position: Floats) -> tuple[Floats, Floats]:
    """Return the pose of a joint's child link.

    Args:
        joint: The joint. For a fixed joint, ``position`` must be 0.
        pos: Position of the parent link, (n, 3) [m].
        quat: Orientation of the parent link, (n, 4), scalar first.
        position: Position of the joint, (n, 1) [rad or m].

    Returns:
        pos (n, 3) [m] and quat_wxyz (n, 4).
    """
    axis = np.array(joint.axis)
    pos = pos + quat_rotate(quat, np.array(joint.origin.pos))
    quat = quat_multiply(quat, np.array(joint.origin.quat_wxyz))
    if joint.type == JointType.PRISMATIC:
        return pos + quat_rotate(quat, axis * position), quat
    turn = np.concatenate([np.cos(0.5 * position), np.sin(0.5 * position) * axis], axis=-1)
    return pos, quat_multiply(quat, turn)


def longest_reach(model: RobotModel, frame: str) -> float:
    """Return an upper bound on the distance of ``frame`` from the root [m]: the sum of the lengths along the chain.

    The bound is infinite if the chain contains a floating, planar or unlimited prismatic joint.
    """
    total = 0.0
    for joint in reversed(joint_path(model, frame)):
        total += float(np.linalg.norm(joint.origin.pos))
        if joint.type is JointType.PRISMATIC:
            total += max(abs(joint.limits.lower), abs(joint.limits.upper))
        elif joint.type in (JointType.FLOATING, JointType.PLANAR):
            total = np.inf
    return total


def _left_product(quat_wxyz: Floats) -> Floats:
    """Return the matrix, (4, 4), that multiplies a quaternion by ``quat_wxyz`` from the left."""
    w, x, y, z = quat_wxyz
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])


def outward(model: RobotModel) -> list[Joint]:
    """Return the joints, sorted so that each joint comes after the joint that moves its parent link."""
    below: dict[str, list[Joint]] = {}
    for joint in model.joints:
        below.setdefault(joint.parent, []).append(joint)
    found: list[Joint] = []
    waiting = [model.root]
    while waiting:
        joints = below.get(waiting.pop(), [])
        found += joints
        waiting += [joint.child for joint in joints]
    return found
