"""What a planner is asked for, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from frobs_controllers_planning.inverse_kinematics import POSITION_TOLERANCE, ROTATION_TOLERANCE
from frobs_controllers_planning.timing import Rest, Trajectory
from frobs_core.arrays import Floats


class Reason(IntEnum):
    """Why there is a plan, or none: the numbers that ``info["frobs/plan_reason"]`` holds."""

    PLANNED = 0
    """There is a plan."""
    START_OUTSIDE_LIMITS = 1
    """A joint is beyond its limits where the motion would begin."""
    START_IN_COLLISION = 2
    """Something touches something where the motion would begin."""
    GOAL_OUTSIDE_LIMITS = 3
    """A joint position of the goal is beyond the joint's limits."""
    GOAL_IN_COLLISION = 4
    """Something touches something, or comes too near, at the goal: with all joint positions that were found for it."""
    GOAL_OUT_OF_REACH = 5
    """No joint positions were found that put the tool at the goal."""
    NO_WAY_FOUND = 6
    """The search gave up; there may be a way."""
    TOO_LONG = 7
    """There is a plan, but its motion takes longer than a control step. Only the controller says so."""


@dataclass(frozen=True)
class ToolGoal:
    """Where the tool centre point should be, in the world.

    Attributes:
        pos: (3,) [m]
        quat_wxyz: (4,) scalar first; None: however it is turned.
        position_tolerance: Largest distance from ``pos`` [m].
        rotation_tolerance: Largest angle from ``quat_wxyz`` [rad].
    """

    pos: Floats
    quat_wxyz: Floats | None = None
    position_tolerance: float = POSITION_TOLERANCE
    rotation_tolerance: float = ROTATION_TOLERANCE


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The answer of a planner.

    Attributes:
        reason: :attr:`Reason.PLANNED`, or why there is no plan.
        path: (n, dof) way-points [rad or m], from start to goal, whose corners the trajectory rounds off; None where
            there is no plan.
        trajectory: Where the joints should be at each time; None where there is no plan.
        seconds: What planning took [s].
    """

    reason: Reason
    path: Floats | None = None
    trajectory: Trajectory | Rest | None = None
    seconds: float = 0.0

    @property
    def success(self) -> bool:
        """Whether there is a plan."""
        return self.reason is Reason.PLANNED
