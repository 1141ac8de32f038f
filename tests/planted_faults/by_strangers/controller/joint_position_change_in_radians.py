"""The largest change in the action that the joints can follow is given in radians per step, not as a fraction of half the range."""

from __future__ import annotations

from frobs_controllers.joint_position import JointPosition
from frobs_core.util.arrays import Floats


class Faulty(JointPosition):
    @property
    def max_action_change(self) -> Floats:
        return self._fastest[0].copy()
