"""The integral of a controller at the physics rate is cleared by a reset of all environments only."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller


class Faulty(Controller):
    command_mode = CommandMode.EFFORT
    rate = "physics"

    def bind(self, joints, control_timestep, decimation):
        self._joints = joints
        self._timestep = control_timestep / decimation
        self._target, self._integral = joints.home.copy(), np.zeros_like(joints.home)
        self._stiffness, self._damping = (gain.copy() for gain in joints.drive_gains())
        self._step = np.minimum(0.1, joints.velocity_limit * control_timestep)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)

    def reset(self, mask):
        rows = slice(None) if mask is None else mask
        self._target[rows] = self._joints.joint_positions[rows]
        if mask is None:
            self._integral[:] = 0.0

    def apply(self, action):
        joints = self._joints
        target = self._target + self._step * np.clip(action, -1.0, 1.0)
        self._target = np.clip(target, joints.position_lower, joints.position_upper)
        return self.update()

    def update(self):
        joints = self._joints
        error = self._target - joints.joint_positions
        self._integral += self._timestep * error
        effort = self._stiffness * (error + self._integral) - self._damping * joints.joint_velocities
        return np.clip(effort, -joints.effort_limit, joints.effort_limit)

    def snapshot(self):
        return {"target": self._target.copy(), "integral": self._integral.copy()}

    def restore(self, snapshot):
        self._target, self._integral = snapshot["target"].copy(), snapshot["integral"].copy()
