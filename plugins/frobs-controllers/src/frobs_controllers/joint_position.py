"""Actions are joint positions, scaled to the position limits."""

from __future__ import annotations

import numpy as np

from frobs_controllers.commanded_positions import CommandedPositions
from frobs_controllers.parameters import position_range
from frobs_core.arrays import Action, Floats
from frobs_core.interfaces import JointGroup


class JointPosition(CommandedPositions):
    """Commands joint positions: −1 is the lower limit, 1 the upper limit, 0 the middle.

    A joint without limits uses [−π, π]. The command respects the velocity limits, because a jump over the whole range
    would fling the arm.
    """

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare for the joints to control.

        Raises:
            ConfigurationError: A prismatic joint has no limits.
        """
        self._lower, self._upper = position_range("joint_position", joints)
        self._middle = 0.5 * (self._lower + self._upper)
        self._half_range = 0.5 * (self._upper - self._lower)
        self._fastest = joints.velocity_limit * control_timestep  # [rad or m] per control step
        self._slowest = -self._fastest
        self._wanted = np.zeros(self._lower.shape)
        super().bind(joints, control_timestep, decimation)

    def apply(self, action: Action) -> Floats:
        """Return the target joint positions, (num_envs, dof) [rad or m], inside the limits."""
        wanted, target = self._wanted, self._target
        np.multiply(action, self._half_range, out=wanted)
        np.add(wanted, self._middle, out=wanted)
        np.subtract(wanted, target, out=wanted)
        np.maximum(wanted, self._slowest, out=wanted)
        np.minimum(wanted, self._fastest, out=wanted)
        np.add(target, wanted, out=target)
        np.maximum(target, self._lower, out=target)  # also limits the action and rounding errors
        np.minimum(target, self._upper, out=target)
        return target

    @property
    def max_action_change(self) -> Floats:
        """(dof,) motion that the velocity limits allow per control step, as a fraction of half the range."""
        with np.errstate(divide="ignore", invalid="ignore"):  # for a joint that cannot move at all
            change = self._fastest[0] / self._half_range[0]
        return np.where(np.isnan(change), np.inf, change)
