"""Targets of a robot's joints, independent of the controller that sets them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.interfaces import CommandMode, RobotHandle

_POSITION, _VELOCITY, _EFFORT = CommandMode.POSITION, CommandMode.VELOCITY, CommandMode.EFFORT


class Drive:
    """Targets of a robot's joints, each in its own command mode, plus additional efforts.

    A robot of FRobs has one command mode for all joints. If their modes differ, all are commanded by position: the
    position of a joint that follows a velocity advances with it, and that of a joint that follows an effort makes the
    drive law output exactly that effort for one physics step.

    Attributes:
        targets: (dof,) [rad or m, rad/s or m/s, N·m or N], each in its joint's mode.
        efforts: (dof,) [N·m or N] additional efforts in any mode.
    """

    def __init__(self, modes: Sequence[CommandMode]) -> None:
        self.modes = list(modes)
        self.targets: Floats = np.zeros(len(self.modes))
        self.efforts: Floats = np.zeros(len(self.modes))
        self._running: Floats = np.zeros(len(self.modes))
        self._ahead: Floats | None = None

    @property
    def needs_every_step(self) -> bool:
        """Whether the commands depend on the state in each physics step."""
        return _EFFORT in self.modes and len(set(self.modes)) > 1

    def set_mode(self, joint: int, mode: CommandMode, robot: RobotHandle) -> None:
        """Change the mode of a joint, and hold it: its current position, zero velocity or zero effort."""
        self.modes[joint] = mode
        self._running[joint] = robot.joint_positions[0, joint]
        self.targets[joint] = self._running[joint] if mode is _POSITION else 0.0

    def hold(self, robot: RobotHandle) -> None:
        """Clear all targets, and hold."""
        for joint, mode in enumerate(self.modes):
            self.set_mode(joint, mode, robot)
        self.efforts[:] = 0.0
        self._ahead = None

    def look_ahead(self, joints: np.ndarray[Any, Any], rows: Floats) -> None:
        """Set targets (n, k) of some joints for each physics step of the next :meth:`command`; the last is kept."""
        if self._ahead is None:
            self._ahead = np.repeat(self.targets[None], len(rows), axis=0)
        self._ahead[:, joints] = rows
        self.targets[joints] = rows[-1]

    def command(self, robot: RobotHandle, steps: int, timestep: float) -> None:
        """Send the robot its commands for the next physics steps.

        Args:
            robot: Handle of the robot.
            steps: Number of physics steps of the next ``step`` of the simulation.
            timestep: Duration of each [s].
        """
        rows, self._ahead = self._ahead, None
        kinds = set(self.modes)
        mode = _POSITION if len(kinds) != 1 else next(iter(kinds))
        if robot.command_mode is not mode:
            robot.set_command_mode(mode)
        values = self.targets[None] if rows is None else rows  # (1 or n, dof)
        if len(kinds) > 1:
            values = self._as_positions(robot, values, steps, timestep)
        if self.efforts.any():
            values = values + self.efforts / self._per_unit(robot, mode)
        robot.command(values if len(values) == 1 else values[None])

    def _as_positions(self, robot: RobotHandle, values: Floats, steps: int, timestep: float) -> Floats:
        stiffness, damping = (gain[0] for gain in robot.drive_gains())
        positions, velocities = robot.joint_positions[0], robot.joint_velocities[0]
        values = np.repeat(values, steps, axis=0) if len(values) == 1 else values.copy()
        ahead = timestep * np.arange(1, steps + 1)
        for joint, mode in enumerate(self.modes):
            if mode is _VELOCITY:
                run = self._running[joint] + values[:, joint] * ahead
                # A joint that is held up must not jump when it is released.
                values[:, joint] = np.clip(run, positions[joint] - 0.5, positions[joint] + 0.5)
                self._running[joint] = values[-1, joint]
            elif mode is _EFFORT:
                pull = values[:, joint] + damping[joint] * velocities[joint]
                values[:, joint] = positions[joint] + pull / max(stiffness[joint], 1e-9)
        return values

    @staticmethod
    def _per_unit(robot: RobotHandle, mode: CommandMode) -> Floats:
        """Return the effort per unit of a command, (dof,) [N·m or N]."""
        stiffness, damping = robot.drive_gains()
        if mode is _EFFORT:
            return np.ones(robot.dof)
        gain: Floats = np.maximum(stiffness[0] if mode is _POSITION else damping[0], 1e-9)
        return gain
