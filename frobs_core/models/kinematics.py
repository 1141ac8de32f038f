"""Where the links of a robot are, for given joint positions: many at once, without an engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError, UnknownNameError
from frobs_core.models.model import Joint, JointType, Pose, RobotModel
from frobs_core.rotations import matrix_from_quat

_ROTATING = (JointType.REVOLUTE, JointType.CONTINUOUS)


@dataclass(frozen=True, eq=False)
class Chain:
    """The moving joints between the root and a link, with all that is fixed folded into them.

    The transform of joint j at position q is A + sin(q)·B + cos(q)·C + q·D, (4, 4) each: its constant frame times its
    motion. The same holds for its quaternion with the half angle: as a matrix that multiplies from the left it is
    P·cos(q/2) + Q·sin(q/2). So a batch is a few elementwise operations, then one stacked product for each joint.

    Attributes:
        columns: (k,) which actuated joint each of the k joints follows.
        multipliers: (k, 1) for mimic joints, else 1.
        offsets: (k, 1) [rad or m]
        halves: (k, 1, 1, 1): 0.5, or 0 for a prismatic joint, which turns nothing.
        transforms: (4, k, 1, 4, 4): A, B, C and D.
        quaternions: (2, k, 1, 4, 4): P and Q.
        pos: (4, 1) the link's origin in the frame of the last moving joint, homogeneous [m].
        quat_wxyz: (4, 1) its orientation there.
    """

    columns: npt.NDArray[np.intp]
    multipliers: Floats
    offsets: Floats
    halves: Floats
    transforms: Floats
    quaternions: Floats
    pos: Floats
    quat_wxyz: Floats


def forward_kinematics(model: RobotModel, frame: str, joint_positions: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Return where a link is, relative to the root link.

    Joints that mimic others follow them; floating and planar joints stay at zero. Row *i* depends on row *i* of
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
        raise ConfigurationError(
            f"joint_positions has the shape {positions.shape}; '{model.name}' takes (n, {dof}): {model.joint_names}."
        )
    q = positions.T.take(chain.columns, axis=0) * chain.multipliers + chain.offsets  # (k, n)
    n = len(positions)
    pos = np.broadcast_to(chain.pos, (n, 4, 1))
    quat = np.broadcast_to(chain.quat_wxyz, (n, 4, 1))
    if len(q):
        angle = q[:, :, None, None]
        a, b, c, d = chain.transforms
        transforms = a + np.sin(angle) * b + np.cos(angle) * c + angle * d  # (k, n, 4, 4)
        p, r = chain.quaternions
        half = chain.halves * angle
        quaternions = np.cos(half) * p + np.sin(half) * r
        for j in range(len(q) - 1, -1, -1):
            pos = transforms[j] @ pos
            quat = quaternions[j] @ quat
    return pos[:, :3, 0].copy(), quat[:, :, 0].copy()


def make_chain(model: RobotModel, frame: str) -> Chain:
    """Fold the path from the root to a link into constants.

    Raises:
        UnknownNameError: No link is named so.
    """
    links = [link.name for link in model.links]
    if frame not in links:
        raise UnknownNameError("link", frame, links)
    columns, multipliers, offsets, halves, transforms, quaternions = [], [], [], [], [], []
    matrix, left = np.eye(4), np.eye(4)  # what is fixed since the last moving joint; its quaternion as a matrix
    for joint in joint_path(model, frame):
        matrix = matrix @ pose_matrix(joint.origin)
        left = left @ _left_product(np.array(joint.origin.quat_wxyz))
        if joint.type not in (*_ROTATING, JointType.PRISMATIC):
            continue
        source, multiplier, offset = resolve_mimic(model, joint)
        columns.append(model.joint_names.index(source))
        multipliers.append(multiplier)
        offsets.append(offset)
        transforms.append([matrix @ part for part in _motion(joint)])
        halves.append(0.5 if joint.type in _ROTATING else 0.0)
        quaternions.append([left, left @ _left_product(np.array([0.0, *joint.axis]))])
        matrix, left = np.eye(4), np.eye(4)
    k = len(columns)
    return Chain(
        columns=np.array(columns, dtype=np.intp),
        multipliers=np.array(multipliers, dtype=float).reshape(k, 1),
        offsets=np.array(offsets, dtype=float).reshape(k, 1),
        halves=np.array(halves, dtype=float).reshape(k, 1, 1, 1),
        transforms=np.ascontiguousarray(np.array(transforms).reshape(k, 4, 1, 4, 4).transpose(1, 0, 2, 3, 4)),
        quaternions=np.ascontiguousarray(np.array(quaternions).reshape(k, 2, 1, 4, 4).transpose(1, 0, 2, 3, 4)),
        pos=matrix[:, 3:].copy(),
        quat_wxyz=left[:, :1].copy(),
    )


def joint_path(model: RobotModel, frame: str) -> list[Joint]:
    """Return the joints from the root to a link, in that order."""
    above = {joint.child: joint for joint in model.joints}
    path = []
    while frame in above:
        path.append(above[frame])
        frame = above[frame].parent
    return path[::-1]


def resolve_mimic(model: RobotModel, joint: Joint) -> tuple[str, float, float]:
    """Return the actuated joint that moves this one, with position = multiplier · its position + offset."""
    by_name = {other.name: other for other in model.joints}
    multiplier, offset = 1.0, 0.0
    while joint.mimic is not None:
        offset += multiplier * joint.mimic.offset
        multiplier *= joint.mimic.multiplier
        joint = by_name[joint.mimic.joint]
    return joint.name, multiplier, offset


def pose_matrix(pose: Pose) -> Floats:
    """Return a pose as a homogeneous matrix, (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = matrix_from_quat(pose.quat_wxyz)
    matrix[:3, 3] = pose.pos
    return matrix


def _motion(joint: Joint) -> list[Floats]:
    """Return A, B, C, D of a joint alone: Rodrigues' formula, or the shift along its axis."""
    parts = [np.zeros((4, 4)) for _ in range(4)]
    axis = np.array(joint.axis)
    if joint.type == JointType.PRISMATIC:
        parts[0] = np.eye(4)
        parts[3][:3, 3] = axis
        return parts
    x, y, z = axis
    outer = axis[:, None] * axis
    parts[0][:3, :3], parts[0][3, 3] = outer, 1.0
    parts[1][:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    parts[2][:3, :3] = np.eye(3) - outer
    return parts


def _left_product(quat_wxyz: Floats) -> Floats:
    """Return the matrix (4, 4) that multiplies a quaternion from the left."""
    w, x, y, z = quat_wxyz
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
