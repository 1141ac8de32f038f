"""Controller whose actions move and rotate the tool center point by up to one step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_controllers.tcp_delta_position import AXES, TcpDeltaPosition
from frobs_core.contracts import JointGroup, Snapshot
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError
from frobs_core.util.rotations import multiply_components
from frobs_core.util.validation import boolean, choice, number_list, positive


class TcpDeltaPose(TcpDeltaPosition):
    """Controller that moves and rotates the tool center point by an action in [−1, 1]⁶ times the step sizes.

    The first three components of an action are a translation along the world's axes. The last three components are a
    rotation vector in the world frame. The controller maintains a target pose, just as
    :class:`~frobs_controllers.tcp_delta_position.TcpDeltaPosition` maintains a target point. An action of 0 holds the
    tool's position and orientation in the world, even if the robot's base moves. If the target is farther away than a
    full step in a component, the base drags the tool along.

    Args:
        max_delta: Translation per axis [m] for an action of 1.
        max_rotation: Rotation per axis [rad] for an action of 1, in (0, 1].
        damping: Damping of the least-squares problem [m/rad]. Higher values make motion smoother but slower near
            singularities and at the limit of the arm's reach. Larger steps require more damping: approximately the
            square root of half the step size.
        posture_gain: Gain, in [0, 1), of a motion that does not move the tool: at each step, the joints cover this
            fraction of their remaining distance to home.
        axes: Components of an action: some or all of ``x``, ``y``, ``z``, ``rx``, ``ry`` and ``rz``, in this order.
            Omitted components of the target keep their current values. For example, with ``["x", "y", "z"]``, the tool
            keeps its orientation.
        target_low: Minimum corner [m] of the box to which the target point is limited, in the world frame, or None for
            no lower limit.
        target_high: Maximum corner [m] of the box to which the target point is limited, in the world frame, or None for
            no upper limit.
        interpolate: Whether the joints move to their new positions at constant speed during a control step. Otherwise,
            the new positions are commanded immediately, and the tool's speed oscillates at the control rate.
        free_yaw: Whether the rotation of the tool about the world's z axis is left free, as for arms with four axes.
    """

    owner = "tcp_delta_pose"

    def __init__(
        self,
        *,
        max_delta: float = 0.05,
        max_rotation: float = 0.15,
        damping: float = 0.1,
        posture_gain: float = 0.02,
        axes: Sequence[str] = AXES,
        target_low: Sequence[float] | None = None,
        target_high: Sequence[float] | None = None,
        interpolate: bool = False,
        free_yaw: bool = False,
    ) -> None:
        super().__init__(max_delta=max_delta, damping=damping, posture_gain=posture_gain)
        self.max_rotation = positive(f"{self.owner}: max_rotation", max_rotation, "rad")
        if self.max_rotation > 1.0:  # twice this rotation about each axis must stay below half a turn
            raise ParameterValueError("max_rotation", max_rotation, "in (0, 1] rad", self.owner)
        self.axes = tuple(choice(f"{self.owner}: axes", axis, AXES) for axis in axes)
        if not self.axes or list(self.axes) != sorted({*self.axes}, key=AXES.index):
            raise ParameterValueError("axes", list(axes), f"some of {', '.join(AXES)}, in this order", self.owner)
        self.interpolate = boolean(f"{self.owner}: interpolate", interpolate)
        self.free_yaw = boolean(f"{self.owner}: free_yaw", free_yaw)
        if self.free_yaw and "rz" in self.axes:
            raise ParameterValueError("axes", list(axes), "without 'rz' if free_yaw is set", self.owner)
        self._has_box = target_low is not None or target_high is not None
        if target_low is not None:
            self._target_low = np.array(number_list(f"{self.owner}: target_low", target_low, 3))
        if target_high is not None:
            self._target_high = np.array(number_list(f"{self.owner}: target_high", target_high, 3))
        if not np.all(self._target_low < self._target_high):
            raise ParameterValueError("target_low", target_low, f"below target_high={target_high}", self.owner)

    @property
    def target_box(self) -> tuple[Floats, Floats]:
        """Minimum and maximum corner of the box to which the target point is limited, (3,) each [m]."""
        return self._target_low, self._target_high

    @property
    def _steps(self) -> tuple[float, ...]:
        return (self.max_delta,) * 3 + (self.max_rotation,) * 3

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        self._target_quat = np.zeros((joints.num_envs, 4))
        super().bind(joints, control_timestep, decimation)
        if self.free_yaw:
            self._ik.free_row = AXES.index("rz")
        columns = [AXES.index(axis) for axis in self.axes]
        consecutive = columns == list(range(columns[0], columns[-1] + 1))
        self._columns = slice(columns[0], columns[-1] + 1) if consecutive else columns
        self._shares = np.arange(1, decimation + 1)[:, None] / decimation  # (decimation, 1)
        self._whole = np.zeros((joints.num_envs, len(AXES)))
        self._translation, self._left_translation = self._step[:, :3], self._moved[:, :3]
        self._left_rotation = self._moved[:, 3:]
        self._inside = np.zeros((joints.num_envs, 3))
        # Arrays of the same shape, because NumPy takes three times as long to broadcast.
        self._low, self._high = (
            np.broadcast_to(corner, self._inside.shape).copy() for corner in (self._target_low, self._target_high)
        )
        self.action_space = gym.spaces.Box(-1.0, 1.0, (len(self.axes),), np.float32)

    def reset(self, mask: Mask | None) -> None:
        """Set the commanded positions and the target pose to the current joint positions and tool pose."""
        super().reset(mask)
        self._target_quat[rows_of(mask)] = self._joints.frame_pose("tcp")[1][rows_of(mask)]

    def apply(self, action: Action) -> Floats:
        """Return the target joint positions [rad or m], within the position limits.

        Returns:
            The positions, (num_envs, dof), or (num_envs, decimation, dof) if ``interpolate`` is set.
        """
        step, left, remainder, error = self._step, self._moved, self._remainder, self._error
        self._whole[:, self._columns] = action
        np.maximum(self._whole, self._minus_ones, out=step)
        np.minimum(step, self._ones, out=step)
        np.multiply(step, self._leash, out=step)
        if self._has_box:
            self._limit_to_box(self._translation)

        pos, quat_wxyz = self._joints.frame_pose("tcp")
        np.subtract(self._target, pos, out=self._left_translation)
        _read_rotation_between(quat_wxyz, self._target_quat, out=self._left_rotation)
        np.subtract(left, self._ik.lead(), out=left)  # the part of earlier steps that is not yet completed
        np.maximum(left, self._minus_leash, out=remainder)
        np.minimum(remainder, self._leash, out=remainder)
        np.add(remainder, step, out=error)

        np.subtract(remainder, left, out=left)  # 0 unless the remainder was clipped
        np.add(left, step, out=left)  # motion of the target
        np.add(self._target, self._left_translation, out=self._target)
        if self._left_rotation.any():
            _rotate(self._target_quat, self._left_rotation)
        if not self.interpolate:
            return self._ik.move(error)
        before = self._ik.commanded.copy()[:, None]
        return np.asarray(before + self._shares * (self._ik.move(error)[:, None] - before))

    def _limit_to_box(self, step: Floats) -> None:
        """Change translations of the target, (num_envs, 3) [m], so that they do not leave the box."""
        inside = self._inside
        np.add(self._target, step, out=inside)
        np.maximum(inside, self._low, out=inside)
        np.minimum(inside, self._high, out=inside)
        np.subtract(inside, self._target, out=step)
        np.maximum(step, self._minus_leash[:, :3], out=step)
        np.minimum(step, self._leash[:, :3], out=step)

    def stored_arrays(self) -> Snapshot:
        """Return the commanded joint positions and the target pose."""
        return {"commanded": self._ik.commanded, "target_pos": self._target, "target_quat_wxyz": self._target_quat}


# A single row is computed with Python floats, which are faster than arrays and round in the same way.


def _read_rotation_between(start: Floats, end: Floats, out: Floats) -> None:
    """Compute the rotations from ``start`` to ``end``, (n, 4), as 2 sin(angle / 2) times their axes in the world frame.

    The result, (n, 3), has the direction of the rotation vector but is slightly shorter, by 1 % at half a radian. It is
    cheaper to compute than the rotation vector, and accurate enough for feedback because both are zero when the
    orientations are equal.
    """
    if len(out) == 1:
        out[0] = _between(*start[0].tolist(), *end[0].tolist())
    else:
        out.T[...] = _between(*start.T, *end.T)


def _between(w1: Any, x1: Any, y1: Any, z1: Any, w2: Any, x2: Any, y2: Any, z2: Any) -> tuple[Any, Any, Any]:
    w, x, y, z = multiply_components(w2, x2, y2, z2, w1, -x1, -y1, -z1)
    double = np.copysign(2.0, w)  # q and −q represent the same rotation; use the shorter path
    return double * x, double * y, double * z


def _rotate(quat_wxyz: Floats, vector: Floats) -> None:
    """Rotate orientations, (n, 4), in place by rotation vectors in the world frame, (n, 3) [rad]."""
    if len(vector) == 1:
        quat_wxyz[0] = _rotated(*vector[0].tolist(), *quat_wxyz[0].tolist())
    else:
        quat_wxyz.T[...] = _rotated(*vector.T, *quat_wxyz.T)


def _rotated(x: Any, y: Any, z: Any, *quat_wxyz: Any) -> tuple[Any, Any, Any, Any]:
    half = np.maximum(0.5 * np.sqrt(x * x + y * y + z * z), 1e-150)  # avoids 0 / 0, whose limit is 1
    factor = 0.5 * np.sin(half) / half
    return multiply_components(np.cos(half), factor * x, factor * y, factor * z, *quat_wxyz)
