"""Controller whose actions are joint positions, scaled to the position limits."""

from __future__ import annotations

import numpy as np

from frobs_controllers.commanded_positions import CommandedPositions
from frobs_controllers.parameters import position_range
from frobs_core.contracts import JointGroup
from frobs_core.util.arrays import Action, Floats


class JointPosition(CommandedPositions):
    """Controller that commands joint positions: −1 is the lower limit, 0 the middle, and 1 the upper limit.

    A joint without limits uses the range [−π, π]. The command respects the velocity limits, because a jump across the
    whole range would make the arm move violently.
    """

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints.

        Raises:
            ConfigurationError: A prismatic joint has no position limits.
        """
        self._lower, self._upper = position_range("joint_position", joints)
        self._middle = 0.5 * (self._lower + self._upper)
        self._half_range = 0.5 * (self._upper - self._lower)
        self._fastest = joints.velocity_limit * control_timestep  # [rad or m] per control step
        self._slowest = -self._fastest
        self._wanted = np.zeros(self._lower.shape)
        super().bind(joints, control_timestep, decimation)

    def apply(self, action: Action) -> Floats:
        """Return the target joint positions, (num_envs, dof) [rad or m], within the position limits."""
        change, target = self._wanted, self._target
        np.multiply(action, self._half_range, out=change)
        np.add(change, self._middle, out=change)
        np.subtract(change, target, out=change)
        np.maximum(change, self._slowest, out=change)
        np.minimum(change, self._fastest, out=change)
        np.add(target, change, out=target)
        np.maximum(target, self._lower, out=target)  # required for actions outside [−1, 1] and rounding errors
        np.minimum(target, self._upper, out=target)
        return target

    @property
    def max_action_change(self) -> Floats:
        """Largest motion per control step that the velocity limits allow, (dof,), as a fraction of half the range."""
        with np.errstate(divide="ignore", invalid="ignore"):  # 0 / 0 occurs for an immovable joint
            change = self._fastest[0] / self._half_range[0]
        return np.where(np.isnan(change), np.inf, change)
