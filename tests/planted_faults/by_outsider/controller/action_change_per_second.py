"""``max_action_change`` is how far an absolute action may change in a second, not in a control step."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller


class Faulty(Controller):
    command_mode = CommandMode.POSITION

    def bind(self, joints, control_timestep, decimation):
        self._lower = np.where(np.isinf(joints.position_lower), -np.pi, joints.position_lower)
        self._upper = np.where(np.isinf(joints.position_upper), np.pi, joints.position_upper)
        self._half = 0.5 * (self._upper - self._lower)
        self._velocity = joints.velocity_limit
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)

    def reset(self, mask):
        pass

    def apply(self, action):
        return self._lower + self._half * (np.clip(action, -1.0, 1.0) + 1.0)

    @property
    def max_action_change(self):
        return (self._velocity / self._half)[0]
