"""Converts planned motions to messages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from frobs_controllers_planning import Plan
from frobs_core.util.arrays import Floats

_SPACING = 0.05  # [s] between points
_LEAST = 10  # minimum number of points in a motion


def to_message(plan: Plan, joint_names: Sequence[str], columns: Sequence[int], offset: Floats, frame: str) -> Any:
    """Convert a plan to a ``moveit_msgs/RobotTrajectory``, which has no points if the plan contains no motion.

    Args:
        plan: Result of the planner.
        joint_names: Joints of the message.
        columns: For each joint of the message, the joint's index in the plan (k,).
        offset: Offset that is added to each joint position (k,) [rad or m].
        frame: The planning frame.
    """
    import rospy
    from moveit_msgs.msg import RobotTrajectory
    from trajectory_msgs.msg import JointTrajectoryPoint

    message = RobotTrajectory()
    message.joint_trajectory.header.frame_id = frame
    message.joint_trajectory.joint_names = list(joint_names)
    if plan.trajectory is None or plan.trajectory.duration == 0.0:
        return message
    count = max(_LEAST, math.ceil(plan.trajectory.duration / _SPACING))
    times = np.linspace(0.0, plan.trajectory.duration, count + 1)
    positions, velocities, accelerations = (rows[:, columns] for rows in plan.trajectory.sample(times))
    for row, seconds in enumerate(times.tolist()):
        message.joint_trajectory.points.append(
            JointTrajectoryPoint(
                positions=(positions[row] + offset).tolist(),
                velocities=velocities[row].tolist(),
                accelerations=accelerations[row].tolist(),
                time_from_start=rospy.Duration.from_sec(seconds),
            )
        )
    return message
