"""Actions are given to the joints in alphabetical order of their names, not in the order of the group."""

from __future__ import annotations

import numpy as np

from templates.my_controller import MyController


class Faulty(MyController):
    def bind(self, joints, control_timestep, decimation):
        super().bind(joints, control_timestep, decimation)
        self._columns = np.argsort(joints.joint_names)

    def apply(self, action):
        ordered = np.empty_like(action)
        ordered[:, self._columns] = action
        return super().apply(ordered)
