"""Controller whose actions move the tool center point by up to one step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from frobs_controllers.inverse_kinematics import DampedLeastSquares
from frobs_core.contracts import CommandMode, Controller, JointGroup, Snapshot
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError
from frobs_core.util.validation import non_negative, positive

AXES = ("x", "y", "z", "rx", "ry", "rz")
"""Components of a pose: translations along the world's axes and rotations about these axes."""


class TcpDeltaPosition(Controller):
    """Controller that moves the tool center point along the world's axes by an action in [−1, 1]³ times a step size.

    Each step is added to a target point. If the tool does not complete a step (because of damping, a limit, or the
    arm's curved path), the following steps make up for the difference, so that the tool does not drift. At most
    ``max_delta`` per axis is carried over from earlier steps, so that the target point stays close to the tool.

    The target point is fixed in the world. If the robot's base moves, the arm keeps the tool in its place until the
    distance per axis reaches ``max_delta``; then the base drags the tool along.

    Args:
        max_delta: Step per axis [m] for an action of 1.
        damping: Damping of the least-squares problem [m/rad]. Higher values make motion smoother but slower near
            singularities and at the limit of the arm's reach. Larger steps require more damping: approximately the
            square root of half the step size.
        posture_gain: Gain, in [0, 1), of a motion that does not move the tool: at each step, the joints cover this
            fraction of their remaining distance to home.
    """

    command_mode = CommandMode.POSITION
    owner: ClassVar[str] = "tcp_delta_position"
    """Name of the controller, used in error messages."""

    axes: tuple[str, ...] = ("x", "y", "z")
    """Components of an action."""

    interpolate: bool = False
    """Whether the joints move to their new positions at constant speed during a control step."""

    _target_low, _target_high = np.array([[-np.inf] * 3, [np.inf] * 3])

    def __init__(self, *, max_delta: float = 0.05, damping: float = 0.1, posture_gain: float = 0.02) -> None:
        self.max_delta = positive(f"{self.owner}: max_delta", max_delta, "m")
        self.damping = positive(f"{self.owner}: damping", damping, "m/rad")
        self.posture_gain = non_negative(f"{self.owner}: posture_gain", posture_gain, "1")
        if self.posture_gain >= 1.0:
            raise ParameterValueError("posture_gain", posture_gain, "in [0, 1)", self.owner)

    @property
    def _steps(self) -> tuple[float, ...]:
        return (self.max_delta,) * 3

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints."""
        self._joints = joints
        shape = (joints.num_envs, len(self._steps))
        self._ik = DampedLeastSquares(
            joints,
            rows=len(self._steps),
            damping=self.damping,
            posture_gain=self.posture_gain,
            control_timestep=control_timestep,
        )
        self._ones, self._minus_ones = np.ones(shape), -np.ones(shape)
        self._leash = np.broadcast_to(self._steps, shape).copy()
        self._minus_leash = -self._leash
        self._step, self._moved, self._remainder, self._error = (np.zeros(shape) for _ in range(4))
        self._target = np.zeros((joints.num_envs, 3))
        self.action_space = gym.spaces.Box(-1.0, 1.0, (len(self._steps),), np.float32)
        self.reset(None)

    def reset(self, mask: Mask | None) -> None:
        """Set the commanded positions and the target point to the current joint positions and tool position."""
        self._ik.commanded[rows_of(mask)] = self._joints.joint_positions[rows_of(mask)]
        self._target[rows_of(mask)] = self._joints.frame_pose("tcp")[0][rows_of(mask)]

    def apply(self, action: Action) -> Floats:
        """Return the target joint positions, (num_envs, dof) [rad or m], within the position limits."""
        step, there, remainder, target, error = self._step, self._moved, self._remainder, self._target, self._error
        np.maximum(action, self._minus_ones, out=step)
        np.minimum(step, self._ones, out=step)
        np.multiply(step, self._leash, out=step)

        np.add(
            self._joints.frame_pose("tcp")[0], self._ik.lead(), out=there
        )  # tool position at the commanded joint positions
        np.subtract(target, there, out=remainder)  # the part of earlier steps that is not yet completed
        np.maximum(remainder, self._minus_leash, out=remainder)
        np.minimum(remainder, self._leash, out=remainder)
        np.add(remainder, step, out=error)
        np.add(there, error, out=target)
        return self._ik.move(self._error)

    def law(self) -> Mapping[str, Any]:
        """Return the numbers of the law, which is that of :class:`.DampedLeastSquares` with a target.

        ``frame`` is the link that the controller moves, ``columns`` are the components of a pose that an action
        changes, and ``steps`` are the sizes of a full step.
        """
        return {
            "law": self.owner,
            "joints": list(self._joints.joint_names),
            "frame": self._joints.frame_name("tcp"),
            "columns": [AXES.index(axis) for axis in self.axes],
            "steps": list(self._steps),
            "target_low": self._target_low.tolist(),
            "target_high": self._target_high.tolist(),
            "interpolate": self.interpolate,
            **self._ik.numbers(),
        }

    def stored_arrays(self) -> Snapshot:
        """Return the commanded joint positions and the target point."""
        return {"commanded": self._ik.commanded, "target": self._target}
