"""A moving goal: each coordinate oscillates about a center."""

from __future__ import annotations

import numpy as np

from frobs_core.arrays import Floats, Mask, rows_of
from frobs_core.interfaces import Snapshot
from frobs_core.random import RandomSource


class Oscillation:
    """center + amplitude · sin(2π · frequency · t + phase) for each axis, drawn again in each episode.

    Args:
        num_envs: ≥ 1.
        max_amplitude: (3,) amplitudes are drawn from [0, max_amplitude) [m].
        max_frequency: (3,) frequencies are drawn from [0, max_frequency) [Hz].
        max_phase: Phases are drawn from [0, max_phase) [rad]. If 0, the motion starts at the center.
    """

    def __init__(
        self, num_envs: int, max_amplitude: Floats, max_frequency: Floats, max_phase: float = 2.0 * np.pi
    ) -> None:
        self._max_amplitude, self._max_frequency, self._max_phase = max_amplitude, max_frequency, max_phase
        self._centre, self._amplitude, self._frequency, self._phase = np.zeros((4, num_envs, 3))

    @property
    def max_speed(self) -> Floats:
        """(3,) [m/s] upper limit of the speed along each axis."""
        return 2.0 * np.pi * self._max_frequency * self._max_amplitude

    def begin(self, mask: Mask | None, rng: RandomSource, *, centre: Floats | None, start: Floats | None) -> None:
        """Draw the motion of an episode.

        Args:
            mask: The n environments.
            rng: Streams ``"goal_amplitude"``, ``"goal_frequency"`` and ``"goal_phase"``.
            centre: (n, 3) [m] center of the motion.
            start: (n, 3) [m] position at time 0, instead of ``centre``.
        """
        rows = rows_of(mask)
        self._amplitude[rows] = rng.uniform("goal_amplitude", 0.0, self._max_amplitude, (3,), mask)
        self._frequency[rows] = rng.uniform("goal_frequency", 0.0, self._max_frequency, (3,), mask)
        self._phase[rows] = rng.uniform("goal_phase", 0.0, self._max_phase, (3,), mask)
        if start is not None:
            centre = start - self._amplitude[rows] * np.sin(self._phase[rows])
        self._centre[rows] = centre

    def at(self, time: Floats) -> tuple[Floats, Floats]:
        """Return pos (num_envs, 3) [m] and velocity (num_envs, 3) [m/s] at a time (num_envs,) [s]."""
        offset, velocity = oscillation(time, self._amplitude, self._frequency, self._phase)
        return self._centre + offset, velocity

    def snapshot(self) -> Snapshot:
        """Return the motion of the current episodes."""
        return {
            "goal_centre": self._centre.copy(),
            "goal_amplitude": self._amplitude.copy(),
            "goal_frequency": self._frequency.copy(),
            "goal_phase": self._phase.copy(),
        }

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._centre[:], self._amplitude[:] = snapshot["goal_centre"], snapshot["goal_amplitude"]
        self._frequency[:], self._phase[:] = snapshot["goal_frequency"], snapshot["goal_phase"]


def oscillation(time: Floats, amplitude: Floats, frequency: Floats, phase: Floats) -> tuple[Floats, Floats]:
    """Return amplitude · sin(2π · frequency · time + phase) and its rate of change.

    Args:
        time: (...) [s]
        amplitude: (..., 3) [m]
        frequency: (..., 3) [Hz]
        phase: (..., 3) [rad]

    Returns:
        offset (..., 3) [m] and velocity (..., 3) [m/s].
    """
    rate = 2.0 * np.pi * frequency
    angle = rate * time[..., None] + phase
    return amplitude * np.sin(angle), amplitude * rate * np.cos(angle)
