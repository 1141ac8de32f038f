"""Time-optimal trajectories along paths, computed with toppra, that respect the limits at every instant."""

from __future__ import annotations

import logging

import numpy as np
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
from toppra.interpolator import AbstractGeometricPath

from frobs_controllers_planning.path import RoundedPath
from frobs_core.util.arrays import Floats

LIMIT_SHARE = 0.995
"""Fraction of the limits that toppra uses. The rest is a margin for deviations between grid points."""

_INTERVALS = 80  # grid intervals along the whole path; each line and each corner has at least _CORNER_INTERVALS
_CORNER_INTERVALS = 8


class Trajectory:
    """Motion along a path over time. The motion starts and ends at rest, and then stays at the end of the path.

    Args:
        path: Path that the trajectory follows.
        at: Path parameters of the grid points, (n + 1,), including the ends of all pieces.
        squares: Squared rate of change of the path parameter at the grid points, (n + 1,) [1/s²]. The squared rate is
            linear between grid points.
        stretch: Factor by which all times are multiplied.

    Attributes:
        duration: Duration of the motion [s].
    """

    def __init__(self, path: RoundedPath, at: Floats, squares: Floats, stretch: float = 1.0) -> None:
        self._path, self._at, self._stretch = path, at, stretch
        self._speeds = np.sqrt(squares)
        self._accelerations = 0.5 * np.diff(squares) / np.diff(at)
        steps = 2.0 * np.diff(at) / (self._speeds[:-1] + self._speeds[1:])
        self._times = np.concatenate([[0.0], np.cumsum(steps)])
        self._pieces = np.searchsorted(path.breaks, 0.5 * (at[:-1] + at[1:]), side="right") - 1
        self.duration = float(self._times[-1]) * stretch

    def sample(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the positions, velocities and accelerations of the joints at the given times.

        Args:
            times: Times (k,) [s]. Before time 0, the joints rest at the start of the path. After the duration, they
                rest at the end.

        Returns:
            Joint positions [rad or m], velocities [rad/s or m/s] and accelerations [rad/s² or m/s²], (k, dof) each.
        """
        times = np.asarray(times, float) / self._stretch
        cell = np.clip(np.searchsorted(self._times, times, side="right") - 1, 0, len(self._accelerations) - 1)
        elapsed = np.clip(times, 0.0, self._times[-1]) - self._times[cell]
        rate = self._speeds[cell] + elapsed * self._accelerations[cell]
        at = self._at[cell] + elapsed * (self._speeds[cell] + 0.5 * elapsed * self._accelerations[cell])
        positions, slopes, bends = self._path.evaluate(np.clip(at, 0.0, self._path.length), self._pieces[cell])
        velocities = slopes * rate[:, None] / self._stretch
        accelerations = (bends * rate[:, None] ** 2 + slopes * self._accelerations[cell][:, None]) / self._stretch**2
        rests = (times <= 0.0) | (times >= self._times[-1])
        velocities[rests], accelerations[rests] = 0.0, 0.0
        return positions, velocities, accelerations

    def extremes(self) -> tuple[Floats, Floats]:
        """Return the maximum velocity [rad/s or m/s] and acceleration [rad/s² or m/s²] of each joint, (dof,) each.

        Between two grid points, accelerations change linearly, so their maximum is at one of the grid points.
        """
        n = len(self._accelerations)
        velocities, accelerations = [], []
        for side in (0, 1):
            _, slopes, bends = self._path.evaluate(self._at[side : n + side], self._pieces)
            rate = self._speeds[side : n + side, None]
            velocities.append(np.abs(slopes * rate))
            accelerations.append(np.abs(bends * rate**2 + slopes * self._accelerations[:, None]))
        return (np.max(velocities, axis=(0, 1)) / self._stretch, np.max(accelerations, axis=(0, 1)) / self._stretch**2)

    def stretched(self, factor: float) -> Trajectory:
        """Return a copy of the trajectory that is slowed down by ``factor``."""
        return Trajectory(self._path, self._at, self._speeds**2, self._stretch * factor)


class Rest:
    """Trajectory of a robot that is already at the goal.

    Args:
        joint_positions: Constant joint positions, (dof,) [rad or m].

    Attributes:
        duration: Duration of the motion [s], always 0.
    """

    duration = 0.0

    def __init__(self, joint_positions: Floats) -> None:
        self._joint_positions = joint_positions.copy()

    def sample(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return constant positions and zero derivatives, in the format of :meth:`Trajectory.sample`."""
        positions = np.tile(self._joint_positions, (len(times), 1))
        return positions, np.zeros_like(positions), np.zeros_like(positions)


class Timing:
    """Solver for the fastest motion along a path within velocity and acceleration limits.

    Args:
        max_velocity: Maximum joint velocities, (dof,) [rad/s or m/s], finite.
        max_acceleration: Maximum joint accelerations, (dof,) [rad/s² or m/s²], finite.
    """

    def __init__(self, max_velocity: Floats, max_acceleration: Floats) -> None:
        self._max_velocity, self._max_acceleration = max_velocity, max_acceleration
        limits = [LIMIT_SHARE * np.stack([-limit, limit], axis=-1) for limit in (max_velocity, max_acceleration)]
        self._constraints = [JointVelocityConstraint(limits[0]), JointAccelerationConstraint(limits[1])]
        logging.getLogger("toppra").setLevel(logging.ERROR)  # hides warnings about rounding errors that toppra corrects

    def follow(self, path: RoundedPath) -> Trajectory | None:
        """Return the fastest trajectory along a path from rest to rest, or None if no timing was found."""
        grid = _grid(path)
        _, speeds, _ = TOPPRA(self._constraints, _ForToppra(path), grid, "seidel").compute_parameterization(0.0, 0.0)
        if speeds is None or not np.isfinite(speeds).all() or (speeds[:-1] + speeds[1:] <= 0.0).any():
            return None
        trajectory = Trajectory(path, grid, speeds**2)
        velocity, acceleration = trajectory.extremes()
        excess = max((velocity / self._max_velocity).max(), np.sqrt((acceleration / self._max_acceleration).max()))
        return trajectory.stretched(float(excess)) if excess > 1.0 else trajectory


def _grid(path: RoundedPath) -> Floats:
    """Return the grid points for toppra as path parameters, (n + 1,), including the ends of all pieces."""
    parts = [np.zeros(1)]
    for begin, end in zip(path.breaks[:-1], path.breaks[1:], strict=True):
        count = max(_CORNER_INTERVALS, round(_INTERVALS * (end - begin) / path.length))
        parts.append(np.linspace(begin, end, count + 1)[1:])
    return np.concatenate(parts)


class _ForToppra(AbstractGeometricPath):
    """Path with toppra's interface. Where a line and a corner meet, the corner's second derivative is used."""

    def __init__(self, path: RoundedPath) -> None:
        self._path = path

    def __call__(self, path_positions: Floats, order: int = 0) -> Floats:
        at = np.atleast_1d(np.asarray(path_positions, float))
        result = self._path.evaluate(at)[order]
        if order == 2:
            before = np.clip(np.searchsorted(self._path.breaks, at, side="left") - 1, 0, len(self._path.breaks) - 2)
            earlier = self._path.evaluate(at, before)[2]
            bent = np.abs(earlier).sum(axis=1) > np.abs(result).sum(axis=1)
            result = np.where(bent[:, None], earlier, result)
        return result if np.ndim(path_positions) else result[0]

    @property
    def dof(self) -> int:
        return int(self._path.evaluate(np.zeros(1))[0].shape[1])

    @property
    def path_interval(self) -> Floats:
        return np.array([0.0, self._path.length])
