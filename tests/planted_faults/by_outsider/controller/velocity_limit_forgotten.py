"""A step is ``max_delta`` for every joint, also for those whose velocity limit does not allow it."""

from __future__ import annotations

import numpy as np

from templates.my_controller import MyController


class Faulty(MyController):
    def bind(self, joints, control_timestep, decimation):
        super().bind(joints, control_timestep, decimation)
        self._step = np.full((joints.num_envs, joints.dof), self.max_delta)
