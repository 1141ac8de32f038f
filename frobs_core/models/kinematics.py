"""Where the links of a robot are, for given joint positions: many at once, without an engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Floats
from frobs_core.errors import ParameterValueError, UnknownNameError
from frobs_core.models.model import Joint, JointType, Pose, RobotModel
from frobs_core.rotations import matrix_from_quat, quat_conjugate, quat_from_matrix, quat_multiply, quat_rotate

MOVING = (JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC)
"""Types of joints that have one position."""


@dataclass(frozen=True, eq=False)
class Chain:
    """The moving joints between the root and a link, with all that is fixed folded into them.

    Every joint's frame is turned so that the joint moves about or along z. What is carried from the tip to the root is
    (7, n): a point [m] and a quaternion. So a joint is three products of arrays that are n long.

    Attributes:
        columns: (k,) which actuated joint each of the k joints follows.
        multipliers: (k, 1) for mimic joints, else 1.
        offsets: (k, 1) [rad or m]
        turns: (k, 1): 1 for a joint that rotates, 0 for one that slides.
        slides: For each of the k joints, whether it slides.
        frames: (k, 7, 7, 1): the rotation of the joint's frame, for points and for quaternions.
        origins: (k, 7, 1): the origin of the joint's frame [m], and zeros.
        tip: (7, 1): the link in the frame of the last moving joint.
    """

    columns: npt.NDArray[np.intp]
    multipliers: Floats
    offsets: Floats
    turns: Floats
    slides: tuple[bool, ...]
    frames: Floats
    origins: Floats
    tip: Floats


_SWAP = np.array([1, 0, 2, 6, 5, 4, 3])  # which component a rotation about z mixes with which


def forward_kinematics(model: RobotModel, frame: str, joint_positions: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Return where a link is, relative to the root link.

    Joints that mimic others follow them; floating, planar and passive joints stay at zero. Row *i* depends on row *i* of
    the joint positions alone, to the last bit, whatever n is.

    Args:
        model: The robot.
        frame: Name of a link.
        joint_positions: (n, dof) [rad or m], in the order of ``model.joint_names``; limits are not looked at.

    Returns:
        pos (n, 3) [m] and quat_wxyz (n, 4), of length 1; its sign varies continuously with the joint positions.

    Raises:
        UnknownNameError: No link is named so.
        ConfigurationError: The joint positions are not (n, dof).
    """
    chain = model._chains.get(frame)
    if chain is None:
        chain = model._chains.setdefault(frame, make_chain(model, frame))
    positions = np.asarray(joint_positions, float)
    dof = len(model.actuated_joints)
    if positions.ndim != 2 or positions.shape[1] != dof:
        raise ParameterValueError(
            "shape of joint_positions",
            positions.shape,
            f"(n, {dof}), a column for each of {model.joint_names}",
            f"'{model.name}'",
        )
    q = positions.T.take(chain.columns, axis=0) * chain.multipliers + chain.offsets  # (k, n)
    cosines, sines = _mixing(q * chain.turns)
    state = np.repeat(chain.tip, len(positions), axis=1)  # (7, n)
    for j in range(len(q) - 1, -1, -1):
        state = cosines[j] * state + sines[j] * state.take(_SWAP, axis=0)
        if chain.slides[j]:
            state[2] += q[j]
        state = (chain.frames[j] * state).sum(axis=1) + chain.origins[j]
    return state[:3].T.copy(), state[3:].T.copy()


def _mixing(angle: Floats) -> tuple[Floats, Floats]:
    """Return what multiplies a state and its swapped components in a rotation about z, (k, 7, n) each."""
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
    """Fold the path from the root to a link into constants.

    Raises:
        UnknownNameError: No link is named so.
    """
    links = [link.name for link in model.links]
    if frame not in links:
        raise UnknownNameError("link", frame, links)
    columns, multipliers, offsets, slides, frames, origins = [], [], [], [], [], []
    state = pose_array(Pose())  # what is fixed since the last moving joint
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
    """Return position [m] and quat_wxyz, (7,)."""
    return np.array([*pose.pos, *pose.quat_wxyz])


def pose_from_array(array: Floats) -> Pose:
    """Return the pose that :func:`pose_array` makes an array of."""
    x, y, z, w, i, j, k = array.tolist()
    return Pose((x, y, z), (w, i, j, k))


def compose(outer: Floats, inner: Floats) -> Floats:
    """Return the pose (7,) of ``inner``, which is given in the frame ``outer``."""
    pos = outer[:3] + quat_rotate(outer[3:], inner[:3])
    return np.concatenate([pos, quat_multiply(outer[3:], inner[3:])])


def _turn_z_to(axis: Floats) -> Floats:
    """Return a quaternion that turns z to a unit axis; it is exact where the axis is one of the frame's."""
    helper = np.eye(3)[(int(np.argmax(np.abs(axis))) + 2) % 3]
    x = np.cross(helper, axis)
    x /= np.sqrt((x * x).sum())
    return quat_from_matrix(np.stack([x, np.cross(axis, x), axis], axis=-1))


def joint_path(model: RobotModel, frame: str) -> list[Joint]:
    """Return the joints from the root to a link, in that order."""
    above = {joint.child: joint for joint in model.joints}
    path = []
    while frame in above:
        path.append(above[frame])
        frame = above[frame].parent
    return path[::-1]


def moved(joint: Joint, pos: Floats, quat: Floats, position: Floats) -> tuple[Floats, Floats]:
    """Return the pose of a joint's child.

    Args:
        joint: A joint that moves, or is fixed and has the position 0.
        pos: (n, 3) of its parent [m].
        quat: (n, 4) of its parent, scalar first.
        position: (n, 1) of the joint [rad or m].

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
    """Return a distance [m] from the root that a link never exceeds: the lengths along its chain, added up.

    Infinite where the chain has a joint that translates without limits.
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
    """Return the matrix (4, 4) that multiplies a quaternion from the left."""
    w, x, y, z = quat_wxyz
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
