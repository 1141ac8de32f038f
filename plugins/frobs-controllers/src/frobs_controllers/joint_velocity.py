"""Controller whose actions are joint velocities, scaled to the velocity limits."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_controllers.parameters import scale
from frobs_core.contracts import CommandMode, Controller, JointGroup
from frobs_core.util.arrays import Action, Floats, Mask
from frobs_core.util.validation import positive


class JointVelocity(Controller):
    """Controller that commands joint velocities: an action of ±1 requests a joint's maximum velocity.

    Near a position limit, a joint is slowed down so that it cannot exceed the limit within the control step.

    Args:
        max_velocity: Upper limit for all joint velocities [rad/s or m/s]. If None, only the model file's limits apply.
    """

    command_mode = CommandMode.VELOCITY

    def __init__(self, *, max_velocity: float | None = None) -> None:
        if max_velocity is not None:
            max_velocity = positive("joint_velocity: max_velocity", max_velocity, "rad/s or m/s")
        self.max_velocity = max_velocity

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints.

        Raises:
            ConfigurationError: A joint has no velocity limit, and ``max_velocity`` is not set.
        """
        self._joints = joints
        self._upper = scale(
            "joint_velocity", "max_velocity", self.max_velocity, joints.velocity_limit, joints, "rad/s or m/s"
        )
        self._lower = -self._upper
        self._position_lower, self._position_upper = joints.position_lower.copy(), joints.position_upper.copy()
        self._rate = np.full(self._upper.shape, 1.0 / control_timestep)  # [1/s]
        self._velocity, self._bound = np.zeros(self._upper.shape), np.zeros(self._upper.shape)
        self.axes = joints.joint_names
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)

    def reset(self, mask: Mask | None) -> None:
        """Do nothing, because this controller has no state."""

    def apply(self, action: Action) -> Floats:
        """Return joint velocities, (num_envs, dof) [rad/s or m/s], within the velocity limits."""
        velocity, bound, positions = self._velocity, self._bound, self._joints.joint_positions
        np.multiply(action, self._upper, out=velocity)
        np.subtract(self._position_upper, positions, out=bound)
        np.multiply(bound, self._rate, out=bound)
        np.minimum(velocity, bound, out=velocity)
        np.subtract(self._position_lower, positions, out=bound)
        np.multiply(bound, self._rate, out=bound)
        np.maximum(velocity, bound, out=velocity)
        # Clip to the velocity limits last, so that a joint placed beyond its position limit is not thrown back.
        np.minimum(velocity, self._upper, out=velocity)
        np.maximum(velocity, self._lower, out=velocity)
        return velocity
