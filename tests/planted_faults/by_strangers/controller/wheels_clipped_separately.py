"""A wheel that would be too fast is slowed down alone, so that the robot follows another curve."""

from __future__ import annotations

import numpy as np

from frobs_controllers.differential_drive import DifferentialDrive
from frobs_core.contracts import JointGroup
from frobs_core.util.arrays import Action, Floats


class Faulty(DifferentialDrive):
    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        super().bind(joints, control_timestep, decimation)
        self._wheels_may_saturate = False

    def apply(self, action: Action) -> Floats:
        return np.clip(super().apply(action), -self._wheel_limit, self._wheel_limit)
