"""One robot: joint positions that follow commands."""

from __future__ import annotations

import numpy as np

from frobs_core.arrays import Floats, Mask, rows_of
from frobs_core.interfaces import Placement, RobotHandle

_LAG = 0.02  # [s] in which an error falls to a third and a little
_STEP = 1e-6  # [rad or m] of the differences that the Jacobian is made of


class IdealRobot(RobotHandle):
    """A robot in every environment; see :class:`frobs_core.interfaces.RobotHandle`."""

    def __init__(self, name: str, placement: Placement, num_envs: int, timestep: float) -> None:
        self.describe(name, placement, num_envs)
        self._timestep, self._share = timestep, 1.0 - np.exp(-timestep / _LAG)
        self._positions, self._velocities = self.home.copy(), np.zeros_like(self.home)

    @property
    def joint_positions(self) -> Floats:
        """(num_envs, dof) [rad or m]."""
        return self._positions.copy()

    @property
    def joint_velocities(self) -> Floats:
        """(num_envs, dof) [rad/s or m/s]."""
        return self._velocities.copy()

    @property
    def joint_efforts(self) -> Floats:
        """(num_envs, dof): zero, as nothing has weight."""
        return np.zeros_like(self._positions)

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        """Put the joints somewhere at once."""
        rows = rows_of(mask)
        self._positions[rows], self._velocities[rows] = positions, velocities

    def go_home(self, rows: slice | Mask) -> None:
        """Go home, at rest, and hold."""
        self._positions[rows], self._velocities[rows] = self.home[rows], 0.0
        self._command[rows], self._command_rows = self.holding_command(self.home[rows]), None

    def advance(self, decimation: int) -> None:
        """Follow for some physics steps."""
        commands = self._take_commands(decimation)
        for k in range(decimation):
            errors = (commands[:, k] - self._positions) * (self._share / self._timestep)
            modes = np.array(self.command_modes)
            wanted = np.select([modes == "position", modes == "velocity"], [errors, commands[:, k]], 0.0)
            self._velocities = np.clip(wanted, -self.velocity_limit, self.velocity_limit)
            self._positions = self._positions + self._timestep * self._velocities
            inside = np.clip(self._positions, self.position_lower, self.position_upper)
            self._velocities[inside != self._positions] = 0.0
            self._positions = inside

    def snapshot(self) -> dict[str, Floats]:
        """Return the joints and what they follow."""
        return {
            "positions": self._positions.copy(),
            "velocities": self._velocities.copy(),
            "held": self._command.copy(),
        }

    def restore(self, state: dict[str, Floats]) -> None:
        """Return to a snapshot."""
        self._positions, self._velocities = state["positions"].copy(), state["velocities"].copy()
        self._command, self._command_rows = state["held"].copy(), None
