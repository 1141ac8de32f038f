"""Requested trajectories, validated and converted to the controller's joint order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import check_name
from frobs_ros.errors import TrajectoryError, TrajectoryJointsError


@dataclass(frozen=True)
class Points:
    """Waypoints of a trajectory.

    Attributes:
        start: Start of the trajectory in simulated time [s], or None to start immediately.
        times: Increasing, nonnegative times since the start, (m,) [s].
        positions: Joint positions, (m, k) [rad or m].
        velocities: Joint velocities, (m, k) [rad/s or m/s], or None if the message contains no velocities.
        accelerations: Joint accelerations, (m, k) [rad/s² or m/s²], or None if the message lacks accelerations or
            velocities.
    """

    start: float | None
    times: Floats
    positions: Floats
    velocities: Floats | None
    accelerations: Floats | None


def read_points(trajectory: Any, joints: Sequence[str], held: Floats, partial: bool) -> Points:
    """Read and validate a trajectory_msgs/JointTrajectory.

    Args:
        trajectory: Message that contains at least one trajectory point.
        joints: Names of the controller's joints, in the column order of the returned arrays.
        held: Positions to use for joints that the message omits, (k,) [rad or m].
        partial: Whether the message may omit joints.

    Raises:
        UnknownNameError: The message contains a joint that the controller does not command.
        ConfigurationError: The message omits a required joint, repeats a joint, or contains invalid numbers.
    """
    names = list(trajectory.joint_names)
    for name in names:
        check_name("joint of this controller", name, joints)
    missing = [name for name in joints if name not in names]
    if (missing and not partial) or len(set(names)) != len(names):
        raise TrajectoryJointsError(names, joints)
    times = np.array([point.time_from_start.to_sec() for point in trajectory.points])
    if (np.diff(times) <= 0.0).any() or times[0] < 0.0:
        raise TrajectoryError(
            f"the times of the trajectory points are {times.tolist()}; they must be at least 0 and increasing."
        )
    columns = [list(joints).index(name) for name in names]
    stamp = trajectory.header.stamp.to_sec()

    def read(field: str, rest: Floats) -> Floats | None:
        rows = [list(getattr(point, field)) for point in trajectory.points]
        if not any(rows):
            return None
        if any(len(row) != len(names) for row in rows) or not np.isfinite(rows).all():
            raise TrajectoryError(f"each trajectory point must have one finite number per joint in '{field}'.")
        found = np.repeat(rest[None], len(rows), axis=0)
        found[:, columns] = rows
        return found

    positions = read("positions", held)
    if positions is None:
        raise TrajectoryError("the points have no positions.")
    velocities = read("velocities", np.zeros(len(joints)))
    accelerations = None if velocities is None else read("accelerations", np.zeros(len(joints)))
    return Points(stamp or None, times, positions, velocities, accelerations)
