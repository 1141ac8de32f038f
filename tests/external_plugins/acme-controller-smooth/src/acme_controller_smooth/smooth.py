"""The controller."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action, Floats, Mask
from frobs_core.errors import ConfigurationError
from frobs_core.interfaces import CommandMode, Controller, JointGroup, Snapshot


class Smooth(Controller):
    """Moves the commanded joint positions by a step that follows the action with a lag.

    Args:
        step: Of an action of 1 that lasts [rad or m].
        memory: Share of the step before in each, in [0, 1).

    Raises:
        ConfigurationError: A value is out of range.
    """

    command_mode = CommandMode.POSITION

    def __init__(self, *, step: float = 0.1, memory: float = 0.5) -> None:
        if not (step > 0 and 0 <= memory < 1):
            raise ConfigurationError(f"smooth: step is {step}, memory {memory}; they must be > 0 and in [0, 1).")
        self.step, self.memory = step, memory

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare for the joints to control."""
        self._joints = joints
        self._velocity, self._target = np.zeros((2, joints.num_envs, joints.dof))
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)
        self.reset(None)

    def reset(self, mask: Mask | None) -> None:
        """Hold the present positions."""
        rows = slice(None) if mask is None else mask
        self._velocity[rows], self._target[rows] = 0.0, self._joints.joint_positions[rows]

    def apply(self, action: Action) -> Floats:
        """Return joint positions, (num_envs, dof) [rad or m], inside the limits."""
        wanted = np.clip(action, -1.0, 1.0) * self.step
        self._velocity = self.memory * self._velocity + (1.0 - self.memory) * wanted
        target = self._target + self._velocity
        self._target = np.clip(target, self._joints.position_lower, self._joints.position_upper)
        return self._target

    def snapshot(self) -> Snapshot:
        """Return what is remembered."""
        return {"velocity": self._velocity.copy(), "target": self._target.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._velocity, self._target = snapshot["velocity"].copy(), snapshot["target"].copy()
