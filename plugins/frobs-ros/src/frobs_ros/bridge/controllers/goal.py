"""A requested trajectory: validated, in the controller's order of joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import UnknownNameError
from frobs_ros.errors import TrajectoryError


@dataclass(frozen=True)
class Points:
    """Waypoints of a trajectory.

    Attributes:
        start: [s] in simulated time; None: immediately.
        times: (m,) [s] from the start, increasing, > 0; positions, velocities and accelerations are (m, k).
    """

    start: float | None
    times: Floats
    positions: Floats
    velocities: Floats | None
    accelerations: Floats | None


def read_points(trajectory: Any, joints: Sequence[str], held: Floats, partial: bool) -> Points:
    """Read and validate a trajectory_msgs/JointTrajectory.

    Args:
        trajectory: Message with at least one point.
        joints: Joints of the controller, in the order of the result.
        held: (k,) positions of joints that the message does not contain [rad or m].
        partial: Whether the message may omit joints.

    Raises:
        UnknownNameError: The message contains a joint that the controller does not have.
        ConfigurationError: The message omits a joint, or contains invalid numbers.
    """
    names = list(trajectory.joint_names)
    for name in names:
        if name not in joints:
            raise UnknownNameError("joint of this controller", name, joints)
    missing = [name for name in joints if name not in names]
    if (missing and not partial) or len(set(names)) != len(names):
        raise TrajectoryError(
            f"the trajectory names the joints {', '.join(names)}; this controller has {', '.join(joints)}."
        )
    times = np.array([point.time_from_start.to_sec() for point in trajectory.points])
    if (np.diff(times) <= 0.0).any() or times[0] < 0.0:
        raise TrajectoryError(f"the times of the points must increase: {times.tolist()}.")
    columns = [list(joints).index(name) for name in names]
    stamp = trajectory.header.stamp.to_sec()

    def read(field: str, rest: Floats) -> Floats | None:
        rows = [list(getattr(point, field)) for point in trajectory.points]
        if not any(rows):
            return None
        if any(len(row) != len(names) for row in rows) or not np.isfinite(rows).all():
            raise TrajectoryError(f"the points' {field} must be one finite number for each joint.")
        found = np.repeat(rest[None], len(rows), axis=0)
        found[:, columns] = rows
        return found

    positions = read("positions", held)
    if positions is None:
        raise TrajectoryError("the points have no positions.")
    velocities = read("velocities", np.zeros(len(joints)))
    accelerations = None if velocities is None else read("accelerations", np.zeros(len(joints)))
    return Points(stamp or None, times, positions, velocities, accelerations)
