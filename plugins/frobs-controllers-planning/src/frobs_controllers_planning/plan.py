"""Planning goals and results."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from frobs_controllers_planning.inverse_kinematics import POSITION_TOLERANCE, ROTATION_TOLERANCE
from frobs_controllers_planning.timing import Rest, Trajectory
from frobs_core.arrays import Floats


class Reason(IntEnum):
    """Planning result, as reported in ``info["frobs/plan_reason"]``."""

    PLANNED = 0
    """There is a plan."""
    START_OUTSIDE_LIMITS = 1
    """A joint is beyond its limits at the start."""
    START_IN_COLLISION = 2
    """Objects touch at the start."""
    GOAL_OUTSIDE_LIMITS = 3
    """A joint position in the goal is beyond the joint's limits."""
    GOAL_IN_COLLISION = 4
    """Objects touch or are too close at the goal, for all joint positions that were found."""
    GOAL_OUT_OF_REACH = 5
    """No joint positions were found for the tool goal."""
    NO_WAY_FOUND = 6
    """The search was stopped; a path may exist."""
    TOO_LONG = 7
    """There is a plan, but its motion takes longer than a control step. Only the controller returns this."""


@dataclass(frozen=True)
class ToolGoal:
    """A target pose of the tool center point in the world.

    Attributes:
        pos: (3,) [m]
        quat_wxyz: (4,) scalar first, or None for any orientation.
        position_tolerance: Maximum distance from ``pos`` [m].
        rotation_tolerance: Maximum angle from ``quat_wxyz`` [rad].
    """

    pos: Floats
    quat_wxyz: Floats | None = None
    position_tolerance: float = POSITION_TOLERANCE
    rotation_tolerance: float = ROTATION_TOLERANCE


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The result of planning.

    Attributes:
        reason: :attr:`Reason.PLANNED`, or why there is no plan.
        path: (n, dof) waypoints [rad or m], from start to goal; the trajectory rounds their corners. None if there is
            no plan.
        trajectory: Joint positions over time; None if there is no plan.
        seconds: Planning time [s].
    """

    reason: Reason
    path: Floats | None = None
    trajectory: Trajectory | Rest | None = None
    seconds: float = 0.0

    @property
    def success(self) -> bool:
        """Whether there is a plan."""
        return self.reason is Reason.PLANNED
