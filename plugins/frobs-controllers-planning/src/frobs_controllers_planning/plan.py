"""Goals and results of motion planning."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from frobs_controllers_planning.inverse_kinematics import POSITION_TOLERANCE, ROTATION_TOLERANCE
from frobs_controllers_planning.timing import Rest, Trajectory
from frobs_core.util.arrays import Floats


class Reason(IntEnum):
    """Result of motion planning, as reported in ``info["frobs/plan_reason"]``."""

    PLANNED = 0
    """A motion was planned."""
    START_OUTSIDE_LIMITS = 1
    """At the start, a joint is beyond its position limits."""
    START_IN_COLLISION = 2
    """At the start, two objects touch."""
    GOAL_OUTSIDE_LIMITS = 3
    """At the goal, a joint is beyond its position limits."""
    GOAL_IN_COLLISION = 4
    """For all joint positions found for the goal, two objects touch or are too close to each other."""
    GOAL_OUT_OF_REACH = 5
    """No joint positions were found for the tool goal."""
    NO_WAY_FOUND = 6
    """The search was stopped without finding a path, although a path may exist."""
    TOO_LONG = 7
    """A path was found, but the motion takes longer than a control step. Only the controller uses this value."""


@dataclass(frozen=True)
class ToolGoal:
    """Target pose of the tool center point in the world frame.

    Attributes:
        pos: Target position, (3,) [m].
        quat_wxyz: Target orientation as a scalar-first quaternion, (4,), or None for any orientation.
        position_tolerance: Maximum distance from ``pos`` [m].
        rotation_tolerance: Maximum angle from ``quat_wxyz`` [rad].
    """

    pos: Floats
    quat_wxyz: Floats | None = None
    position_tolerance: float = POSITION_TOLERANCE
    rotation_tolerance: float = ROTATION_TOLERANCE


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Result of motion planning.

    Attributes:
        reason: :attr:`Reason.PLANNED`, or the reason why planning failed.
        path: Waypoints from start to goal, (n, dof) [rad or m], or None if no path was found. The trajectory rounds the
            corners at the waypoints.
        trajectory: Joint positions over time, or None if planning failed.
        seconds: Time spent on planning [s].
    """

    reason: Reason
    path: Floats | None = None
    trajectory: Trajectory | Rest | None = None
    seconds: float = 0.0

    @property
    def success(self) -> bool:
        """Whether planning succeeded."""
        return self.reason is Reason.PLANNED
