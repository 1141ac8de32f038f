"""Motion of goals whose coordinates oscillate about a center."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import Snapshot, Stateful
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.random import RandomSource


class Oscillation(Stateful):
    """Random motion of a point: center + amplitude · sin(2π · frequency · t + phase) along each axis.

    Args:
        num_envs: Number of environments, ≥ 1.
        max_amplitude: Upper limits of the amplitudes, (3,) [m]. Amplitudes are drawn from [0, ``max_amplitude``).
        max_frequency: Upper limits of the frequencies, (3,) [Hz]. Frequencies are drawn from [0, ``max_frequency``).
        max_phase: Upper limit of the phases [rad]. Phases are drawn from [0, ``max_phase``). If ``max_phase`` is 0,
            motions start at the center.
    """

    def __init__(
        self, num_envs: int, max_amplitude: Floats, max_frequency: Floats, max_phase: float = 2.0 * np.pi
    ) -> None:
        self._max_amplitude, self._max_frequency, self._max_phase = max_amplitude, max_frequency, max_phase
        self._centre, self._amplitude, self._frequency, self._phase = np.zeros((4, num_envs, 3))

    @property
    def max_speed(self) -> Floats:
        """Upper limit of the speed along each axis, (3,) [m/s]."""
        return 2.0 * np.pi * self._max_frequency * self._max_amplitude

    def begin(self, mask: Mask | None, rng: RandomSource, *, centre: Floats | None, start: Floats | None) -> None:
        """Draw the parameters of the motion for the next episode.

        Args:
            mask: The n environments in which an episode begins.
            rng: Random source, of which the streams ``"goal_amplitude"``, ``"goal_frequency"`` and ``"goal_phase"`` are
                used.
            centre: Center of the motion, (n, 3) [m], or None if ``start`` is given.
            start: Position at time 0, (n, 3) [m], from which the center is computed, or None if ``centre`` is given.
        """
        rows = rows_of(mask)
        self._amplitude[rows] = rng.uniform("goal_amplitude", 0.0, self._max_amplitude, (3,), mask)
        self._frequency[rows] = rng.uniform("goal_frequency", 0.0, self._max_frequency, (3,), mask)
        self._phase[rows] = rng.uniform("goal_phase", 0.0, self._max_phase, (3,), mask)
        if start is not None:
            centre = start - self._amplitude[rows] * np.sin(self._phase[rows])
        self._centre[rows] = centre

    def at(self, time: Floats) -> tuple[Floats, Floats]:
        """Return the positions (num_envs, 3) [m] and velocities (num_envs, 3) [m/s] at times (num_envs,) [s]."""
        offset, velocity = oscillation(time, self._amplitude, self._frequency, self._phase)
        return self._centre + offset, velocity

    def stored_arrays(self) -> Snapshot:
        """Return the parameters of the motions in the current episodes."""
        return {
            "goal_centre": self._centre,
            "goal_amplitude": self._amplitude,
            "goal_frequency": self._frequency,
            "goal_phase": self._phase,
        }


def oscillation(time: Floats, amplitude: Floats, frequency: Floats, phase: Floats) -> tuple[Floats, Floats]:
    """Return amplitude · sin(2π · frequency · time + phase) and its time derivative.

    Args:
        time: Time, (...) [s].
        amplitude: Amplitude along each axis, (..., 3) [m].
        frequency: Frequency along each axis, (..., 3) [Hz].
        phase: Phase along each axis, (..., 3) [rad].

    Returns:
        The offset (..., 3) [m] and the velocity (..., 3) [m/s].
    """
    rate = 2.0 * np.pi * frequency
    angle = rate * time[..., None] + phase
    return amplitude * np.sin(angle), amplitude * rate * np.cos(angle)
