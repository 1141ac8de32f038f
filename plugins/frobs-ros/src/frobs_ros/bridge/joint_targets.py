"""Joint targets of a robot, independent of the controllers that set the targets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.util.arrays import Floats

_POSITION, _VELOCITY, _EFFORT = CommandMode.POSITION, CommandMode.VELOCITY, CommandMode.EFFORT


class JointTargets:
    """Joint targets of a robot, with a command mode for each joint, plus additional efforts.

    A FRobs robot has one command mode for all joints. If the joints' modes differ, all joints are commanded by
    position. For a joint in velocity mode, the position target advances at the target velocity. For a joint in effort
    mode, the position target is chosen such that the drive law outputs exactly the target effort for one physics step.

    Attributes:
        targets: (dof,) joint targets: positions, velocities or efforts, depending on each joint's mode [rad or m,
            rad/s or m/s, N·m or N].
        efforts: (dof,) additional efforts, which are applied in all modes [N·m or N].
    """

    def __init__(self, modes: Sequence[CommandMode]) -> None:
        self.modes = list(modes)
        self.targets: Floats = np.zeros(len(self.modes))
        self.efforts: Floats = np.zeros(len(self.modes))
        self._running: Floats = np.zeros(len(self.modes))
        self._ahead: Floats | None = None

    @property
    def needs_every_step(self) -> bool:
        """Whether the commands must be recomputed from the state at each physics step."""
        return _EFFORT in self.modes and len(set(self.modes)) > 1

    def set_mode(self, joint: int, mode: CommandMode, robot: RobotHandle) -> None:
        """Change a joint's mode and set its target to the current position, zero velocity or zero effort."""
        self.modes[joint] = mode
        self._running[joint] = robot.joint_positions[0, joint]
        self.targets[joint] = self._running[joint] if mode is _POSITION else 0.0

    def hold(self, robot: RobotHandle) -> None:
        """Hold all joints and clear the additional efforts."""
        for joint, mode in enumerate(self.modes):
            self.set_mode(joint, mode, robot)
        self.efforts[:] = 0.0
        self._ahead = None

    def look_ahead(self, joints: np.ndarray[Any, Any], rows: Floats) -> None:
        """Set the targets of some joints, (n, k), for each of the n physics steps of the next :meth:`command` call.

        The joints keep the last target after these steps.
        """
        if self._ahead is None:
            self._ahead = np.repeat(self.targets[None], len(rows), axis=0)
        self._ahead[:, joints] = rows
        self.targets[joints] = rows[-1]

    def command(self, robot: RobotHandle, steps: int, timestep: float) -> None:
        """Send the commands for the next physics steps to the robot.

        Args:
            robot: Handle of the robot.
            steps: Number of physics steps in the simulation's next ``step`` call.
            timestep: Duration of a physics step [s].
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
                # Keep the target close to the position, so that a blocked joint does not jump when it is released.
                values[:, joint] = np.clip(run, positions[joint] - 0.5, positions[joint] + 0.5)
                self._running[joint] = values[-1, joint]
            elif mode is _EFFORT:
                pull = values[:, joint] + damping[joint] * velocities[joint]
                values[:, joint] = positions[joint] + pull / max(stiffness[joint], 1e-9)
        return values

    @staticmethod
    def _per_unit(robot: RobotHandle, mode: CommandMode) -> Floats:
        """Return the (dof,) effort that one unit of a command produces in the given mode [N·m or N]."""
        stiffness, damping = robot.drive_gains()
        if mode is _EFFORT:
            return np.ones(robot.dof)
        gain: Floats = np.maximum(stiffness[0] if mode is _POSITION else damping[0], 1e-9)
        return gain
