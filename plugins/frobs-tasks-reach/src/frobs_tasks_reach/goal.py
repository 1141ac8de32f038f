"""Goal-conditioned reaching task for hindsight experience replay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from frobs_core.contracts import PositionGoalTask, distance_between, position_goal_rewards
from frobs_core.description import ObservationTerm, Rewards
from frobs_tasks_reach.reach import Reach

_FASTEST = 2.0
"""Bound on observed joint velocities, as a multiple of the limits, because collisions can cause higher velocities."""


class ReachGoal(Reach, PositionGoalTask):
    """Goal-conditioned task of moving the tool center point to a goal and holding it there.

    Goals, initial states, success and the end of episodes are defined as in :class:`frobs_tasks_reach.reach.Reach`. The
    observation is a dictionary of float32 arrays in SI units: ``observation`` (2 · dof + 3: joint positions, joint
    velocities, tool position), ``achieved_goal`` (3: tool position) and ``desired_goal`` (3). The observation includes
    joint velocities because, with a sparse reward, an arm whose drives lag would otherwise oscillate around the goal.

    For the reward, see :class:`~frobs_core.contracts.PositionGoalTask`:

    {rewards}

    Args:
        tolerance: Maximum distance between the tool and the goal at which the goal is considered reached [m].
        goal_low: Minimum corner of the goal box in the world frame [m], or None to derive the corner from the tool's
            reach.
        goal_high: Maximum corner of the goal box in the world frame [m], or None to derive the corner from the tool's
            reach.
        initial: Joint positions at reset: ``"home"``, or ``"random"`` for random positions within the limits.

    Raises:
        ConfigurationError: A value is out of range.
    """

    rewards: ClassVar[Rewards] = position_goal_rewards("outside", "the tool")
    _sees_from_shoulder: ClassVar[bool] = False

    def __init__(
        self,
        *,
        tolerance: float = 0.05,
        goal_low: Sequence[float] | None = None,
        goal_high: Sequence[float] | None = None,
        initial: str = "home",
    ) -> None:
        super().__init__(tolerance=tolerance, goal_low=goal_low, goal_high=goal_high, initial=initial)

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the terms of ``observation``, ``achieved_goal`` and ``desired_goal``."""
        robot, known = self._robot, super().observation_terms()
        fastest = _FASTEST * robot.velocity_limit[0]
        return {
            "joint_positions": known["joint_positions"],
            "joint_velocities": ObservationTerm(
                read=lambda: np.clip(robot.joint_velocities, -fastest, fastest),
                low=-fastest,
                high=fastest,
                unit="rad/s or m/s",
                scale=0.2,
                proprioceptive=True,
            ),
            "tcp_position": known["tcp_position"],
            "achieved_goal": replace(known["tcp_position"], key="achieved_goal"),
            "desired_goal": replace(known["goal"], key="desired_goal"),
        }

    def _compare(self) -> None:
        self.distance = self.goal_distance = distance_between(
            self._tcp.astype(np.float32), self._goal.astype(np.float32)
        )
