"""The rotation of an action is about the axes of the tool, not about those of the world."""

from __future__ import annotations

import numpy as np

from frobs_controllers.tcp_delta_pose import AXES, TcpDeltaPose
from frobs_core.util.rotations import quat_rotate


class Faulty(TcpDeltaPose):
    def apply(self, action):
        if self.axes != AXES:
            return super().apply(action)
        action = np.clip(action, -1.0, 1.0)
        turn = quat_rotate(self._joints.frame_pose("tcp")[1], action[:, 3:])
        return super().apply(np.concatenate([action[:, :3], turn], axis=1))
