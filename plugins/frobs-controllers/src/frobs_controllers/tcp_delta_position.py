"""Actions move the tool center point by up to one step."""

from __future__ import annotations

from typing import ClassVar

import gymnasium as gym
import numpy as np

from frobs_controllers.inverse_kinematics import DampedLeastSquares
from frobs_core.arrays import Action, Floats, Mask, rows_of
from frobs_core.errors import ParameterValueError
from frobs_core.interfaces import CommandMode, Controller, JointGroup, Snapshot
from frobs_core.validation import non_negative, positive


class TcpDeltaPosition(Controller):
    """Moves the tool center point along the world's axes by an action in [−1, 1], times a step size.

    Steps are added to a target point. If a step is not completed (because of damping, a limit, or the arm's curved
    path), the following steps make up for it, so the tool does not drift. The target cannot run away: at most
    ``max_delta`` per axis is carried over from earlier steps.

    Args:
        max_delta: Step for an action of 1, per axis [m].
        damping: Damping in the least-squares problem [m/rad]. Higher values make motion smoother near singularities and
            at the limit of reach, but slower. Larger steps need more damping, about the square root of half the step.
        posture_gain: Fraction of the way to home that the joints move in each step without affecting the tool, in
            [0, 1).
    """

    command_mode = CommandMode.POSITION
    owner: ClassVar[str] = "tcp_delta_position"
    """Name of the controller, for error messages."""

    axes: tuple[str, ...] = ("x", "y", "z")
    """Components of an action."""

    def __init__(self, *, max_delta: float = 0.05, damping: float = 0.1, posture_gain: float = 0.02) -> None:
        self.max_delta = positive(f"{self.owner}: max_delta", max_delta, "m")
        self.damping = positive(f"{self.owner}: damping", damping, "m/rad")
        self.posture_gain = non_negative(f"{self.owner}: posture_gain", posture_gain, "1")
        if self.posture_gain >= 1.0:
            raise ParameterValueError("posture_gain", posture_gain, "in [0, 1)", self.owner)

    @property
    def _steps(self) -> tuple[float, ...]:
        """Return each component's step for an action of 1."""
        return (self.max_delta,) * 3

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare for the joints to control."""
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
        """Command the current positions, and use the tool's current position as the target."""
        self._ik.commanded[rows_of(mask)] = self._joints.joint_positions[rows_of(mask)]
        self._target[rows_of(mask)] = self._joints.frame_pose("tcp")[0][rows_of(mask)]

    def apply(self, action: Action) -> Floats:
        """Return the target joint positions, (num_envs, dof) [rad or m], inside the limits."""
        step, there, remainder, target, error = self._step, self._moved, self._remainder, self._target, self._error
        np.maximum(action, self._minus_ones, out=step)
        np.minimum(step, self._ones, out=step)
        np.multiply(step, self._leash, out=step)

        np.add(
            self._joints.frame_pose("tcp")[0], self._ik.lead(), out=there
        )  # tool position at the commanded joint positions
        np.subtract(target, there, out=remainder)  # part of earlier steps not yet completed
        np.maximum(remainder, self._minus_leash, out=remainder)
        np.minimum(remainder, self._leash, out=remainder)
        np.add(remainder, step, out=error)
        np.add(there, error, out=target)
        return self._ik.move(self._error)

    def snapshot(self) -> Snapshot:
        """Return the commanded joint positions and the target point."""
        return {"commanded": self._ik.commanded.copy(), "target": self._target.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._ik.commanded[:], self._target[:] = snapshot["commanded"], snapshot["target"]
