"""Commanded angles are wrapped to half a turn to either side, so that joints with more range spin back."""

from __future__ import annotations

import numpy as np

from frobs_controllers.joint_delta_position import JointDeltaPosition
from frobs_core.contracts import JointGroup
from frobs_core.models import JointType
from frobs_core.util.arrays import Action, Floats


class Faulty(JointDeltaPosition):
    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        self._turns = np.array([joint.type is not JointType.PRISMATIC for joint in joints.joints])
        super().bind(joints, control_timestep, decimation)

    def apply(self, action: Action) -> Floats:
        target = super().apply(action)
        wrapped = np.mod(target + np.pi, 2.0 * np.pi) - np.pi
        target[:] = np.where(self._turns, wrapped, target)
        return target
