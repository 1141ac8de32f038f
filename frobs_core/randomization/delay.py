"""Actions that take effect late."""

from __future__ import annotations

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.interfaces import CommandMode, RobotHandle
from frobs_core.interfaces.simulation import Snapshot
from frobs_core.random import RandomSource
from frobs_core.randomization.distribution import Distribution
from frobs_core.randomization.schedule import Draw, Sample
from frobs_core.randomization.settings import Setting


class ActionDelay:
    """Hands over commands some control steps after the controller made them.

    Before the first one arrives the drives hold: the joint positions at reset, no velocity, or no effort. That is why
    commands are kept and not actions, which have no neutral value that every controller shares.

    Args:
        setting: What the steps are drawn from.
        robot: That is commanded.
        control_timestep: [s]
    """

    def __init__(self, setting: Setting, robot: RobotHandle, control_timestep: float) -> None:
        self._robot = robot
        self._holds_positions = robot.command_mode is CommandMode.POSITION
        steps = np.zeros(robot.num_envs)
        self.draw = Draw(setting.stream, setting.schedule, whole_steps(setting.distribution), steps, control_timestep)
        depth = int(setting.distribution.high) + 1
        # The newest first. One row for each physics step, where the controller makes them.
        self._history: Floats = np.zeros((robot.num_envs, depth, 1, robot.dof))
        self._each = np.arange(robot.num_envs)

    def begin(self, rng: RandomSource, mask: Mask) -> None:
        """Draw for episodes that begin, and let their drives hold; call it when the task has placed the robot."""
        self.draw.begin(rng, mask)
        self._history[mask] = self._robot.joint_positions[mask][:, None, None] if self._holds_positions else 0.0

    def apply(self, rng: RandomSource, command: Floats) -> Floats:
        """Take a new command, and return the one that arrives now; (num_envs, dof) or (num_envs, decimation, dof)."""
        if self.draw.changes_in_episode:
            self.draw.step(rng)
        rows = command if command.ndim == 3 else command[:, None]
        if rows.shape[1] > self._history.shape[2]:
            self._history = np.repeat(self._history, rows.shape[1], axis=2)
        history = self._history
        history[:, 1:] = history[:, :-1].copy()
        history[:, 0] = rows
        arriving: Floats = history[self._each, self.draw.numbers.astype(np.intp)]
        return arriving[:, 0] if arriving.shape[1] == 1 else arriving

    def snapshot(self) -> Snapshot:
        """Return the commands that are on their way."""
        return {"action_delay/history": self._history.copy(), **self.draw.snapshot()}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._history = snapshot["action_delay/history"].copy()
        self.draw.restore(snapshot)


def whole_steps(distribution: Distribution) -> Sample:
    """Return what draws a delay, (n,) whole numbers of control steps, as floats."""
    low, high = int(distribution.low), int(distribution.high)

    def sample(rng: RandomSource, stream: str, mask: Mask | None) -> Floats:
        return rng.integers(stream, low, high + 1, (), mask).astype(np.float64)

    return sample
