"""Inverse kinematics of an arm's tool."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.models import joint_path
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_difference

_SEEDS = 64
_ITERATIONS = 100
DAMPING = 0.05  # [m/rad] damping of the least-squares problem
_PROBE = 1e-6  # [rad or m] finite-difference step for the Jacobian
_LONGEST = 0.3  # [rad or m] maximum joint motion per iteration
_NEAR = 1e-4  # [m, rad] maximum pose error of a solution
CLEARANCE = 0.03  # [m] minimum height above the floor of each link frame beyond the second joint

YAW = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
"""Components of a pose error that count if the tool may have any rotation about the vertical axis."""


@dataclass
class ToolKinematics:
    """Kinematics of the joints that move a tool. A posture consists of the positions of these joints.

    Attributes:
        frame_pose: Function that returns the positions (n, 3) [m] and orientations (n, 4) of a frame, by its name, at
            positions of all joints (n, dof) [rad or m].
        frame: Frame of the tool.
        links: Links that must be above the floor.
        columns: Indices of the joints that move the tool.
        low: Minimum positions of these joints [rad or m].
        high: Maximum positions of these joints [rad or m].
        rest: Positions of all joints that do not move the tool, and preferred positions of the others, (dof,).
        counted: Components of a pose error (x, y, z, rx, ry, rz) that count: 1, and those that do not: 0.
    """

    frame_pose: Callable[[str, Floats], tuple[Floats, Floats]]
    frame: str
    links: Sequence[str]
    columns: Sequence[int]
    low: Floats
    high: Floats
    rest: Floats
    counted: Floats

    def __post_init__(self) -> None:
        self.low = np.where(np.isfinite(self.low), self.low, -np.pi)
        self.high = np.where(np.isfinite(self.high), self.high, np.pi)

    @classmethod
    def of(cls, robot: RobotHandle, free_yaw: bool) -> ToolKinematics:
        """Return the kinematics of a robot's tool in the world frame."""
        path = joint_path(robot.model, robot.frame_name("tcp"))
        columns = [robot.joint_names.index(joint.name) for joint in path if joint.name in robot.joint_names]
        low, high = robot.position_lower[0, columns], robot.position_upper[0, columns]
        links, counted = [joint.child for joint in path[2:]], YAW if free_yaw else np.ones(6)
        return cls(robot.planned_frame_pose, "tcp", links, columns, low, high, robot.home[0], counted)

    def counting(self, counted: Floats) -> ToolKinematics:
        """Return a copy in which other components of a pose error count."""
        other = copy(self)
        other.counted = self.counted * counted
        return other

    def widened(self, by: float) -> ToolKinematics:
        """Return a copy whose joints move farther in both directions [rad or m]."""
        other = copy(self)
        other.low, other.high = self.low - by, self.high + by
        return other

    def complete(self, postures: Floats) -> Floats:
        """Return the positions of all joints, (n, dof) [rad or m]."""
        joints = np.tile(self.rest, (len(postures), 1))
        joints[:, self.columns] = postures
        return joints

    def pose(self, postures: Floats) -> tuple[Floats, Floats]:
        """Return the positions (n, 3) [m] and orientations (n, 4) of the tool."""
        return self.frame_pose(self.frame, self.complete(postures))

    def lowest(self, postures: Floats) -> Floats:
        """Return the height of the lowest link, (n,) [m]."""
        joints = self.complete(postures)
        frames = self.links or [self.frame]
        return np.asarray(np.min([self.frame_pose(link, joints)[0][:, 2] for link in frames], axis=0))

    def margin(self, postures: Floats) -> Floats:
        """Return the smallest distance from a joint limit, (n,) [rad or m]."""
        return np.asarray(np.minimum(postures - self.low, self.high - postures).min(axis=1))

    def error(self, postures: Floats, pos: Floats, quat_wxyz: Floats) -> Floats:
        """Return the translation and rotation from the tool's pose to the target pose, (n, 6) [m, rad]."""
        there, turned = self.pose(postures)
        rotation = quat_difference(np.broadcast_to(quat_wxyz, turned.shape), turned)
        return np.asarray(np.concatenate([pos - there, rotation], axis=1) * self.counted)

    def jacobian(self, postures: Floats) -> Floats:
        """Return the tool's Jacobian by finite differences, (n, 6, joints)."""
        pos, quat = self.pose(postures)
        columns = []
        for joint in range(postures.shape[1]):
            probed = postures.copy()
            probed[:, joint] += _PROBE
            moved, turned = self.pose(probed)
            columns.append(np.concatenate([moved - pos, quat_difference(turned, quat)], axis=1) / _PROBE)
        return np.asarray(np.stack(columns, axis=-1) * self.counted[:, None])

    def solve(
        self,
        postures: Floats,
        pos: Floats,
        quat_wxyz: Floats,
        iterations: int,
        damping: float = DAMPING,
        longest: float | Floats = _LONGEST,
        posture_gain: float = 0.0,
    ) -> Floats:
        """Move postures (n, joints) toward poses of the tool by damped least squares, as ``tcp_delta_pose`` does.

        Args:
            postures: Initial postures.
            pos: Target positions, (3,) or (n, 3) [m].
            quat_wxyz: Target orientations, scalar first, (4,) or (n, 4).
            iterations: Number of iterations.
            damping: Damping of the least-squares problem [m/rad].
            longest: Maximum joint motion per iteration [rad or m].
            posture_gain: Gain of a motion to the rest posture that does not move the tool.
        """
        for _ in range(iterations):
            jacobian = self.jacobian(postures)
            drift = posture_gain * (self.rest[self.columns] - postures)
            error = self.error(postures, pos, quat_wxyz) - (jacobian @ drift[:, :, None])[:, :, 0]
            gram = np.einsum("nij,nkj->nik", jacobian, jacobian) + damping**2 * np.eye(6)
            step = np.einsum("nij,ni->nj", jacobian, np.linalg.solve(gram, error[:, :, None])[:, :, 0]) + drift
            postures = np.clip(postures + np.clip(step, -longest, longest), self.low, self.high)
        return postures

    def find(
        self,
        pos: Floats,
        quat_wxyz: Floats,
        *,
        near: Sequence[float] = (_NEAR, _NEAR),
        floor: bool = True,
        seeds: int = _SEEDS,
    ) -> Floats | None:
        """Return the positions of all joints near rest that bring the tool to a pose, (dof,) [rad or m], or None.

        The search starts from the rest posture and from random postures.

        Args:
            pos: Target position, (3,) [m].
            quat_wxyz: Target orientation, scalar first, (4,).
            near: Maximum errors of a posture [m], [rad].
            floor: Whether the links must be above the floor.
            seeds: Number of random postures.
        """
        low, high = (self.rest.copy() for _ in range(2))
        low[self.columns], high[self.columns] = self.low, self.high
        random = np.random.default_rng(0).uniform(low, high, (seeds, len(self.rest)))
        postures = np.concatenate([self.rest[None], random])[:, self.columns]
        postures = self.solve(postures, pos, quat_wxyz, min(_ITERATIONS, 4 * seeds))
        error = np.abs(self.error(postures, pos, quat_wxyz)).reshape(-1, 2, 3).max(axis=2)
        usable = (error < near).all(axis=1)
        if floor:
            usable &= self.lowest(postures) > min(CLEARANCE, pos[2] - 1e-3)
        if not usable.any():
            return None
        far = ((postures - self.rest[self.columns]) ** 2).sum(axis=1)
        return np.asarray(self.complete(postures[[np.argmin(np.where(usable, far, np.inf))]])[0])
