"""Joint trajectories as piecewise polynomials of time, as in joint_trajectory_controller."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import Floats


class Spline:
    """Trajectory through waypoints with linear, cubic or quintic segments, depending on which derivatives are given.

    Args:
        times: (m,) [s], increasing; m ≥ 1.
        positions: Joint positions, (m, k) [rad or m].
        velocities: Joint velocities, (m, k) [rad/s or m/s], or None for linear segments.
        accelerations: Joint accelerations, (m, k) [rad/s² or m/s²], or None for linear or cubic segments.
    """

    def __init__(
        self, times: Floats, positions: Floats, velocities: Floats | None = None, accelerations: Floats | None = None
    ) -> None:
        self.times, self._last = times, positions[-1]
        spans = np.diff(times)[:, None]  # (m − 1, 1)
        p0, p1 = positions[:-1], positions[1:]
        coefficients = np.zeros((6, *p0.shape))
        coefficients[0] = p0
        if velocities is None:
            coefficients[1] = (p1 - p0) / spans
        elif accelerations is None:
            v0, v1 = velocities[:-1], velocities[1:]
            coefficients[1] = v0
            coefficients[2] = (3.0 * (p1 - p0) / spans - 2.0 * v0 - v1) / spans
            coefficients[3] = (2.0 * (p0 - p1) / spans + v0 + v1) / spans**2
        else:
            v0, v1, a0, a1 = velocities[:-1], velocities[1:], accelerations[:-1], accelerations[1:]
            # Final position, velocity and acceleration, minus the values that a constant acceleration a0 would yield.
            d = p1 - p0 - v0 * spans - 0.5 * a0 * spans**2
            dv, da = v1 - v0 - a0 * spans, a1 - a0
            coefficients[1], coefficients[2] = v0, 0.5 * a0
            coefficients[3] = (10.0 * d - 4.0 * dv * spans + 0.5 * da * spans**2) / spans**3
            coefficients[4] = (-15.0 * d + 7.0 * dv * spans - da * spans**2) / spans**4
            coefficients[5] = (6.0 * d - 3.0 * dv * spans + 0.5 * da * spans**2) / spans**5
        self._coefficients = coefficients

    @property
    def end(self) -> float:
        """End of the trajectory [s]."""
        return float(self.times[-1])

    def sample(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the (n, k) positions, velocities and accelerations at (n,) ``times`` [s].

        Before the start and after the end, the position is constant and the velocity and acceleration are 0.
        """
        if len(self.times) == 1:
            still = np.broadcast_to(self._last, (len(times), len(self._last)))
            return still.copy(), np.zeros(still.shape), np.zeros(still.shape)
        number = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        t = np.clip(times - self.times[number], 0.0, np.diff(self.times)[number])[:, None]
        c = self._coefficients[:, number]  # (6, n, k)
        position = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))
        velocity = c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * (4.0 * c[4] + t * 5.0 * c[5])))
        acceleration = 2.0 * c[2] + t * (6.0 * c[3] + t * (12.0 * c[4] + t * 20.0 * c[5]))
        moving = ((times >= self.times[0]) & (times < self.times[-1]))[:, None]
        return position, np.where(moving, velocity, 0.0), np.where(moving, acceleration, 0.0)
