"""Goal-conditioned reaching task for hindsight experience replay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from frobs_core.contracts import GoalTask, StepContext
from frobs_core.description import ObservationTerm
from frobs_core.util.arrays import Floats
from frobs_tasks_reach.reach import Reach, distance, missed

_FASTEST = 2.0
"""Bound on observed joint velocities, as a multiple of the limits, because collisions can cause higher velocities."""


class ReachGoal(Reach, GoalTask):
    """Goal-conditioned task of moving the tool center point to a goal and holding it there.

    Goals, initial states, success and the end of episodes are defined as in :class:`frobs_tasks_reach.reach.Reach`. The
    observation is a dictionary of float32 arrays in SI units: ``observation`` (2 · dof + 3: joint positions, joint
    velocities, tool position), ``achieved_goal`` (3: tool position) and ``desired_goal`` (3). The observation includes
    joint velocities because, with a sparse reward, an arm whose drives lag would otherwise oscillate around the goal.

    The reward depends on the distance d between the achieved and the desired goal *as observed*, that is, rounded to
    float32. The results of :meth:`reward` and of :meth:`compute_reward` for a replayed observation are therefore
    bit-identical.

    - ``sparse``: 0 if d ≤ tolerance, otherwise −1
    - ``dense``: −d

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

    reward_types: ClassVar[Sequence[str]] = ("sparse", "dense")
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "outside": "−1 if d > tolerance, otherwise 0, where d is the distance from the tool to the goal",
        "distance": "−d",
    }

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

    def reward(self, context: StepContext) -> Floats:
        """Return the reward of each environment, (num_envs,)."""
        reward = self._reward(self._distance)
        self._reward_terms = {"outside" if self.reward_type == "sparse" else "distance": reward}
        return reward

    def reward_terms(self) -> Mapping[str, Floats]:
        """Return the reward term ``outside`` (sparse) or ``distance`` (dense), (num_envs,)."""
        return self._reward_terms

    def compute_reward(self, achieved_goal: Floats, desired_goal: Floats, info: Any) -> Floats:
        """Compute the reward for achieved and desired goals, independently of the current state.

        Args:
            achieved_goal: Achieved goals, (..., 3) [m].
            desired_goal: Desired goals, (..., 3) [m].
            info: Ignored.

        Returns:
            The rewards, (...) float64.
        """
        return self._reward(_goal_distance(achieved_goal, desired_goal))

    def _reward(self, distance: Floats) -> Floats:
        return missed(distance, self._tolerance) if self.reward_type == "sparse" else -distance

    def _compare(self) -> None:
        self._distance = _goal_distance(self._tcp.astype(np.float32), self._goal.astype(np.float32))


def _goal_distance(achieved_goal: npt.ArrayLike, desired_goal: npt.ArrayLike) -> Floats:
    """Return the distance between two goals [m] as float64, for goals of any dtype."""
    return distance(np.asarray(desired_goal, np.float64) - np.asarray(achieved_goal, np.float64))
