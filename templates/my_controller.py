"""The controller: it converts an action into a command for the joints, once per control step.

The controller handles any number of environments at once: every array has one row per environment.
"""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller, JointGroup, Snapshot
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError


class MyController(Controller):
    """Moves the commanded joint positions by a smoothed action, so that the motion is not jerky.

    Args:
        max_delta: Joint motion per control step for an action of 1 [rad or m], if the joint's velocity limit allows it.
        smoothing: Fraction of the previous step's action that is kept, in [0, 1).
    """

    command_mode = CommandMode.POSITION  # type of the commands that apply() returns: joint positions

    def __init__(self, *, max_delta: float = 0.15, smoothing: float = 0.3) -> None:
        if not max_delta > 0.0:
            raise ParameterValueError("max_delta", max_delta, "above 0 [rad or m]")
        if not 0.0 <= smoothing < 1.0:
            raise ParameterValueError("smoothing", smoothing, "in [0, 1)")
        self.max_delta = max_delta
        self.smoothing = smoothing

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare for a robot. An action has one number in [−1, 1] per joint."""
        self._joints = joints
        self._lower, self._upper = joints.position_lower.copy(), joints.position_upper.copy()  # (num_envs, dof)
        self._target: Floats = joints.home.copy()
        self._smooth: Floats = np.zeros_like(self._target)
        self._step = np.minimum(
            self.max_delta, joints.velocity_limit * control_timestep
        )  # limited by the joint's velocity
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)

    def reset(self, mask: Mask | None) -> None:
        """Start from the joint positions in which the task has placed the robot."""
        rows = rows_of(mask)
        self._target[rows] = self._joints.joint_positions[rows]
        self._smooth[rows] = 0.0

    def apply(self, action: Action) -> Floats:
        """Return the target joint positions, (num_envs, dof) [rad or m].

        Each step is added to the commanded positions. If the steps were added to the measured positions, an arm would
        sink, because gravity pulls the arm slightly below the command.
        """
        self._smooth = self.smoothing * self._smooth + (1.0 - self.smoothing) * np.clip(action, -1.0, 1.0)
        self._target = np.clip(self._target + self._step * self._smooth, self._lower, self._upper)
        return self._target

    def snapshot(self) -> Snapshot:
        """Return all state that ``apply`` depends on besides its argument, so that training can resume exactly."""
        return {"target": self._target.copy(), "smooth": self._smooth.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._target, self._smooth = snapshot["target"].copy(), snapshot["smooth"].copy()


if __name__ == "__main__":  # python my_controller.py checks the controller's contract
    from frobs_core.plugins.records import ControllerRecord
    from frobs_devkit.testing import check_controller, run_checks

    record = ControllerRecord(name="my_controller", summary="smooth steps", entry_point="__main__:MyController")
    for result in run_checks(check_controller(record)).results:
        print(result.status, result.name, result.message)
