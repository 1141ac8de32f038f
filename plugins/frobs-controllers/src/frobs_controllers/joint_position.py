"""Actions are joint positions, scaled to the limits."""

from __future__ import annotations

import numpy as np

from frobs_controllers.commanded_positions import CommandedPositions
from frobs_controllers.parameters import position_range
from frobs_core.arrays import Action, Floats
from frobs_core.interfaces import JointGroup


class JointPosition(CommandedPositions):
    """Commands the joint positions that an action names: −1 is the lower limit, 1 the upper, 0 the middle.

    A joint without limits turns in [−π, π]. The command goes there no faster than the velocity limits allow: a jump
    over the whole range would throw the arm.
    """

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare for the joints to control.

        Raises:
            ConfigurationError: A prismatic joint has no limits.
        """
        self._lower, self._upper = position_range("joint_position", joints)
        self._middle = 0.5 * (self._lower + self._upper)
        self._half_range = 0.5 * (self._upper - self._lower)
        self._fastest = joints.velocity_limit * control_timestep  # (num_envs, dof) [rad or m] in a control step
        self._slowest = -self._fastest
        self._wanted = np.zeros(self._lower.shape)
        super().bind(joints, control_timestep, decimation)

    def apply(self, action: Action) -> Floats:
        """Return the joint positions to go to, (num_envs, dof) [rad or m], inside the limits."""
        wanted, target = self._wanted, self._target
        np.multiply(action, self._half_range, out=wanted)
        np.add(wanted, self._middle, out=wanted)
        np.subtract(wanted, target, out=wanted)
        np.maximum(wanted, self._slowest, out=wanted)
        np.minimum(wanted, self._fastest, out=wanted)
        np.add(target, wanted, out=target)
        np.maximum(target, self._lower, out=target)  # bounds the action too, and rounding
        np.minimum(target, self._upper, out=target)
        return target

    @property
    def max_action_change(self) -> Floats:
        """(dof,) what the velocity limits allow in a control step, as a share of half the range."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a joint that cannot move at all
            change = self._fastest[0] / self._half_range[0]
        return np.where(np.isnan(change), np.inf, change)
