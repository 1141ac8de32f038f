"""Delayed actions."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts.control import Control
from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.sensing.randomization.draw import Draw, Setting
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import SettingError
from frobs_core.util.random import RandomSource


class ActionDelay(Stateful):
    """Delay of all robot commands by a random number of control steps.

    Until the first command arrives, the drives hold the reset positions, zero velocity or zero effort, depending on the
    command mode. Commands are delayed instead of actions, because not every controller has a neutral action.
    The delay is the same for all robots. The commands of controllers that run at the physics rate cannot be delayed.
    """

    def __init__(self, setting: Setting, control: Control, control_timestep: float) -> None:
        if control.physics_rate:
            raise SettingError(
                setting.place,
                "the commands of a controller that runs at the physics rate cannot be delayed; remove this setting.",
            )
        self._names = list(control.robots)
        self._robots = [robot.robot for robot in control.robots.values()]
        num_envs = self._robots[0].num_envs
        self.draw = Draw(setting, num_envs, control_timestep)
        depth = int(setting.distribution.high) + 1
        # Commands of each robot, (num_envs, longest delay + 1, 1 or decimation, dof), newest first.
        self._histories: list[Floats] = [np.zeros((num_envs, depth, 1, robot.dof)) for robot in self._robots]
        self._each = np.arange(num_envs)
        self.draws = [self.draw]

    def begin(self, rng: RandomSource, mask: Mask) -> None:
        """Draw delays for new episodes, and fill the histories with commands that hold the robots in place.

        Call this method after the task has placed the robots.
        """
        self.draw.begin(rng, mask)
        for robot, history in zip(self._robots, self._histories, strict=True):
            history[mask] = robot.holding_command(robot.joint_positions[mask])[:, None, None]

    def apply(self, rng: RandomSource, commands: list[Floats]) -> list[Floats]:
        """Store the new commands, and return the commands that take effect now.

        The returned commands are (num_envs, dof) or (num_envs, decimation, dof) each.
        """
        if self.draw.changes_in_episode:
            self.draw.step(rng)
        return [self._delayed(number, command) for number, command in enumerate(commands)]

    def _delayed(self, number: int, command: Floats) -> Floats:
        rows, history = command if command.ndim == 3 else command[:, None], self._histories[number]
        if rows.shape[1] > history.shape[2]:
            history = self._histories[number] = np.repeat(history, rows.shape[1], axis=2)
        history[:, 1:] = history[:, :-1].copy()
        history[:, 0] = rows
        arriving: Floats = history[self._each, self.draw.numbers.astype(np.intp)]
        return arriving[:, 0] if arriving.shape[1] == 1 else arriving

    def stored_arrays(self) -> Snapshot:
        return dict(zip(self._names, self._histories, strict=True))

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot, in which the commands may have another number of rows per step."""
        self._histories = [snapshot[name].copy() for name in self._names]
