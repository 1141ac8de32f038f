"""Trajectory tolerances, which are read from the controller's parameters and from action goals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats

SETTLING = 0.5
"""Minimum settling time at the end of a trajectory [s].

FRobs drives need time to settle because they accelerate masses, whereas Gazebo sets joint positions directly.
"""


@dataclass(frozen=True)
class Tolerances:
    """Trajectory tolerances for k joints. A tolerance of 0 disables the corresponding check.

    Attributes:
        path: (k,) position tolerances during the motion [rad or m].
        goal: (k,) position tolerances at the end [rad or m].
        goal_velocity: (k,) velocity tolerances at the end [rad/s or m/s].
        goal_time: Time allowed after the end of the trajectory for reaching the goal [s].
    """

    path: Floats
    goal: Floats
    goal_velocity: Floats
    goal_time: float

    @classmethod
    def from_parameters(cls, joints: Sequence[str], parameters: Mapping[str, Any]) -> Tolerances:
        """Read the tolerances from a controller's ``constraints`` parameter."""
        constraints = parameters.get("constraints", {})
        of_joints = [constraints.get(joint, {}) for joint in joints]
        stopped = float(constraints.get("stopped_velocity_tolerance", 0.01))
        return cls(
            path=np.array([float(each.get("trajectory", 0.0)) for each in of_joints]),
            goal=np.array([float(each.get("goal", 0.0)) for each in of_joints]),
            goal_velocity=np.full(len(joints), stopped),
            goal_time=max(SETTLING, float(constraints.get("goal_time", 0.0))),
        )

    def updated(self, joints: Sequence[str], goal: Any) -> Tolerances:
        """Return a copy of the tolerances with the changes that a FollowJointTrajectoryGoal requests.

        For each joint, a tolerance of 0 keeps the current tolerance, and a negative tolerance disables the check.
        """
        path, end, speed = self.path.copy(), self.goal.copy(), self.goal_velocity.copy()
        for tolerance in goal.path_tolerance:
            if tolerance.name in joints:
                _change(path, joints.index(tolerance.name), tolerance.position)
        for tolerance in goal.goal_tolerance:
            if tolerance.name in joints:
                _change(end, joints.index(tolerance.name), tolerance.position)
                _change(speed, joints.index(tolerance.name), tolerance.velocity)
        given = goal.goal_time_tolerance.to_sec()
        return Tolerances(path, end, speed, self.goal_time if given == 0.0 else max(SETTLING, given))

    def path_violation(self, error: Floats) -> int | None:
        """Return the index of a joint that is too far from the trajectory, or None."""
        return _first(self.path, error)

    def goal_violation(self, error: Floats, velocity: Floats) -> int | None:
        """Return the index of a joint that has not reached the goal, or None."""
        found = _first(self.goal, error)
        return _first(self.goal_velocity, velocity) if found is None else found


def _change(values: Floats, joint: int, given: float) -> None:
    if given != 0.0:
        values[joint] = max(0.0, given)


def _first(tolerances: Floats, errors: Floats) -> int | None:
    found = np.flatnonzero((tolerances > 0.0) & (np.abs(errors) > tolerances))
    return int(found[0]) if len(found) else None
