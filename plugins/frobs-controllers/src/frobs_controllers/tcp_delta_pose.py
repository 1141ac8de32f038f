"""Controller whose actions move and rotate the tool center point by up to one step."""

from __future__ import annotations

from collections.abc import Sequence

import gymnasium as gym
import numpy as np

from frobs_controllers.rotations import quat_between, quat_from_rotation_vector
from frobs_controllers.tcp_delta_position import TcpDeltaPosition
from frobs_core.contracts import JointGroup, Snapshot
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError
from frobs_core.util.rotations import quat_multiply
from frobs_core.util.validation import boolean, choice, number_list, positive

AXES = ("x", "y", "z", "rx", "ry", "rz")
"""Components of an action: translations along the world's axes and rotations about these axes."""


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
    ) -> None:
        super().__init__(max_delta=max_delta, damping=damping, posture_gain=posture_gain)
        self.max_rotation = positive(f"{self.owner}: max_rotation", max_rotation, "rad")
        if self.max_rotation > 1.0:  # twice this rotation about each axis must stay below half a turn
            raise ParameterValueError("max_rotation", max_rotation, "in (0, 1] rad", self.owner)
        self.axes = tuple(choice(f"{self.owner}: axes", axis, AXES) for axis in axes)
        if not self.axes or list(self.axes) != sorted({*self.axes}, key=AXES.index):
            raise ParameterValueError("axes", list(axes), f"some of {', '.join(AXES)}, in this order", self.owner)
        self.interpolate = boolean(f"{self.owner}: interpolate", interpolate)
        self._has_box = target_low is not None or target_high is not None
        self._target_low, self._target_high = np.full((2, 3), [[-np.inf], [np.inf]])
        if target_low is not None:
            self._target_low = np.array(number_list(f"{self.owner}: target_low", target_low, 3))
        if target_high is not None:
            self._target_high = np.array(number_list(f"{self.owner}: target_high", target_high, 3))
        if not np.all(self._target_low < self._target_high):
            raise ParameterValueError("target_low", target_low, f"below target_high={target_high}", self.owner)

    @property
    def _steps(self) -> tuple[float, ...]:
        return (self.max_delta,) * 3 + (self.max_rotation,) * 3

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints."""
        self._target_quat = np.zeros((joints.num_envs, 4))
        super().bind(joints, control_timestep, decimation)
        self._columns = None if self.axes == AXES else [AXES.index(axis) for axis in self.axes]
        self._shares = np.arange(1, decimation + 1)[:, None] / decimation  # (decimation, 1)
        self._whole = np.zeros((joints.num_envs, len(AXES)))
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
        step, left, remainder = self._step, self._moved, self._remainder
        if self._columns is not None:
            self._whole[:, self._columns] = action
            action = self._whole
        np.maximum(action, self._minus_ones, out=step)
        np.minimum(step, self._ones, out=step)
        np.multiply(step, self._leash, out=step)
        if self._has_box:
            # np.minimum and np.maximum together take less than half the time of np.clip.
            new_target = np.minimum(np.maximum(self._target + step[:, :3], self._target_low), self._target_high)
            step[:, :3] = np.minimum(np.maximum(new_target - self._target, -self.max_delta), self.max_delta)

        pos, quat_wxyz = self._joints.frame_pose("tcp")
        np.subtract(self._target, pos, out=left[:, :3])
        left[:, 3:] = quat_between(quat_wxyz, self._target_quat)
        np.subtract(left, self._ik.lead(), out=left)  # the part of earlier steps that is not yet completed
        np.maximum(left, self._minus_leash, out=remainder)
        np.minimum(remainder, self._leash, out=remainder)
        np.add(remainder, step, out=self._error)

        np.subtract(remainder, left, out=left)  # 0 unless the remainder was clipped
        np.add(left, step, out=left)  # motion of the target
        np.add(self._target, left[:, :3], out=self._target)
        self._target_quat[:] = quat_multiply(quat_from_rotation_vector(left[:, 3:]), self._target_quat)
        if not self.interpolate:
            return self._ik.move(self._error)
        before = self._ik.commanded.copy()[:, None]
        return np.asarray(before + self._shares * (self._ik.move(self._error)[:, None] - before))

    def stored_arrays(self) -> Snapshot:
        """Return the commanded joint positions and the target pose."""
        return {"commanded": self._ik.commanded, "target_pos": self._target, "target_quat_wxyz": self._target_quat}
