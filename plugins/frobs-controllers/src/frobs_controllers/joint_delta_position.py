"""Controller whose actions change the commanded joint positions by up to one step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_controllers.commanded_positions import CommandedPositions
from frobs_controllers.parameters import position_range
from frobs_core.contracts import JointGroup
from frobs_core.util.arrays import Action, Floats
from frobs_core.util.validation import boolean, positive


class JointDeltaPosition(CommandedPositions):
    """Controller that changes the commanded joint positions by an action in [−1, 1] times a step size.

    Steps are added to the *commanded* positions, not to the measured ones. Gravity pulls the joints slightly below the
    command, so an arm whose steps started from the measured positions would sink. Steps respect the velocity limits, so
    that the command does not run ahead of the joints.

    Args:
        max_delta: Step for an action of 1 [rad or m]. The step is smaller if a joint's velocity limit requires it.
        full_range: Whether to behave like FRobs_RL: an action in [−1, 1] is scaled to the joint limits and added to the
            *measured* positions. In this mode, ``max_delta`` has no effect, and an action of 0 holds the position only
            if the limits are symmetric.
    """

    def __init__(self, *, max_delta: float = 0.15, full_range: bool = False) -> None:
        self.max_delta = positive("joint_delta_position: max_delta", max_delta, "rad or m")
        self.full_range = boolean("joint_delta_position: full_range", full_range)

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints.

        Raises:
            ConfigurationError: ``full_range`` is set, and a prismatic joint has no position limits.
        """
        shape = (joints.num_envs, joints.dof)
        if self.full_range:
            self._lower, self._upper = position_range("joint_delta_position", joints)
            self._middle, self._scale = (self._upper + self._lower) / 2, (self._upper - self._lower) / 2
        else:
            self._lower, self._upper = joints.position_lower.copy(), joints.position_upper.copy()
            self._scale = np.minimum(self.max_delta, joints.velocity_limit * control_timestep)
        self._ones, self._minus_ones = np.ones(shape), -np.ones(shape)
        self._delta = np.zeros(shape)
        super().bind(joints, control_timestep, decimation)

    def apply(self, action: Action) -> Floats:
        """Return the target joint positions, (num_envs, dof) [rad or m], within the position limits."""
        delta, target = self._delta, self._target
        np.maximum(action, self._minus_ones, out=delta)
        np.minimum(delta, self._ones, out=delta)
        np.multiply(delta, self._scale, out=delta)
        if self.full_range:
            np.add(self._joints.joint_positions, self._middle, out=target)
        np.add(target, delta, out=target)
        np.maximum(target, self._lower, out=target)
        np.minimum(target, self._upper, out=target)
        return target

    def law(self) -> Mapping[str, Any]:
        """Return the numbers of the law: target = clip(target + scale · action).

        With ``full_range``, ``middle`` is not None, and target = clip(joint positions + middle + scale · action).
        """
        return {
            "law": "joint_delta_position",
            "joints": list(self.axes),
            "scale": self._scale[0].tolist(),
            "middle": self._middle[0].tolist() if self.full_range else None,
            "lower": self._lower[0].tolist(),
            "upper": self._upper[0].tolist(),
        }
