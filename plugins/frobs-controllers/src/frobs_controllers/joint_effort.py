"""Controller whose actions are joint efforts, scaled to the effort limits."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_controllers.parameters import scale
from frobs_core.contracts import CommandMode, Controller, JointGroup
from frobs_core.util.arrays import Action, Floats, Mask
from frobs_core.util.validation import positive


class JointEffort(Controller):
    """Controller that commands joint efforts: an action of ±1 applies a joint's maximum effort.

    An action of 0 applies no effort, so the joints fall freely.

    Args:
        max_effort: Upper limit for all joint efforts [N·m or N]. If None, only the model file's limits apply.
    """

    command_mode = CommandMode.EFFORT

    def __init__(self, *, max_effort: float | None = None) -> None:
        if max_effort is not None:
            max_effort = positive("joint_effort: max_effort", max_effort, "N·m or N")
        self.max_effort = max_effort

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints.

        Raises:
            ConfigurationError: A joint has no effort limit, and ``max_effort`` is not set.
        """
        self._upper = scale("joint_effort", "max_effort", self.max_effort, joints.effort_limit, joints, "N·m or N")
        self._lower = -self._upper
        self._effort = np.zeros(self._upper.shape)
        self.axes = joints.joint_names
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)

    def reset(self, mask: Mask | None) -> None:
        """Do nothing, because this controller has no state."""

    def apply(self, action: Action) -> Floats:
        """Return joint efforts, (num_envs, dof) [N·m or N], within the effort limits."""
        np.multiply(action, self._upper, out=self._effort)
        np.maximum(self._effort, self._lower, out=self._effort)
        np.minimum(self._effort, self._upper, out=self._effort)
        return self._effort
