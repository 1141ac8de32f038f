"""Joint trajectories, as joint_trajectory_controller of ros2_control interpolates them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_ros2.errors import SettingsError


class Trajectory:
    """A motion through waypoints, which begins at the current positions.

    Segments are linear, or cubic if all points have velocities.

    Args:
        message: A ``trajectory_msgs/msg/JointTrajectory``.
        joint_names: Joints of the controller.
        start: Positions of these joints, (dof,) [rad or m].
        lower: Lower position limits, (dof,) [rad or m].
        upper: Upper position limits, (dof,) [rad or m].

    Attributes:
        columns: Columns of the moving joints among ``joint_names``, (k,).

    Raises:
        SettingsError: A joint is unknown, a number is missing or not finite, a position is outside its limits, or times
            do not increase.
    """

    def __init__(self, message: Any, joint_names: Sequence[str], start: Floats, lower: Floats, upper: Floats) -> None:
        names = list(message.joint_names)
        unknown = sorted(set(names) - set(joint_names))
        if unknown or not names or len(set(names)) < len(names):
            raise SettingsError(
                f"the trajectory names the joints {', '.join(names) or 'none'}; it must name each joint once, from "
                f"{', '.join(joint_names)}."
            )
        self.columns = np.array([list(joint_names).index(name) for name in names])
        times = [point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in message.points]
        lengths = {len(point.positions) for point in message.points}
        if not times or lengths != {len(names)} or times[0] < 0.0 or (np.diff(times) <= 0.0).any():
            raise SettingsError(
                f"the trajectory has {len(times)} points; it needs at least one, each with {len(names)} positions and a "
                "later time_from_start than the previous one."
            )
        positions = np.array([point.positions for point in message.points], float)
        outside = (positions < lower[self.columns] - 1e-6) | (positions > upper[self.columns] + 1e-6)
        if not np.isfinite(positions).all() or outside.any():
            row, column = np.argwhere(outside | ~np.isfinite(positions))[0]
            raise SettingsError(
                f"point {row} moves joint '{names[column]}' to {positions[row, column]:g}; the limits are "
                f"[{lower[self.columns[column]]:g}, {upper[self.columns[column]]:g}]."
            )
        given = [point.velocities for point in message.points]
        cubic = all(len(row) == len(names) for row in given) and bool(np.isfinite(np.array(given, float)).all())
        velocities = np.array(given, float) if cubic else np.zeros_like(positions)
        if times[0] > 0.0:
            times = [0.0, *times]
            positions = np.vstack([start[self.columns], positions])
            velocities = np.vstack([np.zeros(len(names)), velocities])
        self._times, self._positions = np.array(times), positions
        self._velocities = velocities if cubic else None

    @property
    def duration(self) -> float:
        """Time from the start to the last point [s]."""
        return float(self._times[-1])

    def sample(self, time: float) -> Floats:
        """Return the positions of the moving joints, (k,), ``time`` seconds after the start."""
        last = len(self._times) - 1
        if time >= self._times[last] or last == 0:
            return np.array(self._positions[last])
        i = max(0, int(np.searchsorted(self._times, time, side="right")) - 1)
        span = self._times[i + 1] - self._times[i]
        s, p0, p1 = (time - self._times[i]) / span, self._positions[i], self._positions[i + 1]
        if self._velocities is None:
            return np.asarray(p0 + s * (p1 - p0))
        v0, v1 = span * self._velocities[i], span * self._velocities[i + 1]
        # Cubic Hermite polynomial
        return np.asarray(
            (1 + 2 * s) * (1 - s) ** 2 * p0 + s * (1 - s) ** 2 * v0 + s * s * (3 - 2 * s) * p1 + s * s * (s - 1) * v1
        )
