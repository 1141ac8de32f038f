"""The interface for goal-conditioned tasks, for hindsight experience replay."""

from __future__ import annotations

from abc import abstractmethod
from functools import reduce
from operator import add
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

from frobs_core.contracts.task import Task
from frobs_core.description.reward_term import Rewards, RewardTerm
from frobs_core.util.arrays import Floats


class GoalTask(Task):
    """A goal-conditioned task, with observation terms under the keys ``"achieved_goal"`` and ``"desired_goal"``."""

    @abstractmethod
    def compute_reward(self, achieved_goal: Floats, desired_goal: Floats, info: Any) -> Floats:
        """Return the reward for given goals, regardless of the current state.

        Args:
            achieved_goal: (..., k)
            desired_goal: (..., k)
            info: Ignored.

        Returns:
            Rewards of the shape (...), which equal :meth:`reward` for the goals of the last step.
        """


class PositionGoalTask(GoalTask):
    """A goal-conditioned task whose goals are positions, and whose reward depends only on the distance to the goal.

    The functions of its reward terms use only ``goal_distance`` and ``tolerance``, as those of
    :func:`position_goal_rewards` do. The distance is that between the goals *as observed*, that is, rounded to float32.
    The results of :meth:`reward` and of :meth:`compute_reward` for an observation are therefore bit-identical.

    Attributes:
        tolerance: Maximum distance at which the goal is considered reached [m].
        goal_distance: Distance between the observed goals, (num_envs,) [m], which the task measures at each step.
    """

    tolerance: float
    goal_distance: Floats

    def compute_reward(self, achieved_goal: Floats, desired_goal: Floats, info: Any) -> Floats:
        """Return the rewards (...) for goals (..., 3) [m], as :meth:`GoalTask.compute_reward`."""
        measured = SimpleNamespace(
            goal_distance=distance_between(achieved_goal, desired_goal), tolerance=self.tolerance
        )
        terms = self.rewards[self.reward_type].values()
        return np.asarray(reduce(add, [term.weight_in(self) * term.function(measured) for term in terms]))


def position_goal_rewards(outside: str, what: str) -> Rewards:
    """Return a sparse and a dense reward for the distance from ``what`` to the goal.

    Args:
        outside: Name of the sparse reward's term.
        what: Words for that which must be at the goal, such as ``"the tool"``.
    """
    distance = f"d is the distance from {what} to the goal"
    far = RewardTerm(
        function=lambda measured: np.where(measured.goal_distance <= measured.tolerance, 0.0, -1.0),
        meaning=f"−1 if d > tolerance, otherwise 0, where {distance}",
    )
    near = RewardTerm(
        function=lambda measured: measured.goal_distance, weight=-1.0, meaning=f"d, where {distance}", unit="m"
    )
    return {"sparse": {outside: far}, "dense": {"distance": near}}


def distance_between(achieved_goal: npt.ArrayLike, desired_goal: npt.ArrayLike) -> Floats:
    """Return the distances (...) [m] as float64 between goals of any dtype and memory layout.

    Args:
        achieved_goal: (..., 3) [m]
        desired_goal: (..., 3) [m]
    """
    offset = np.asarray(desired_goal, np.float64) - np.asarray(achieved_goal, np.float64)
    # Add the columns one by one to fix the order of additions, so that the result is bit-identical for every shape.
    x, y, z = np.moveaxis(offset, -1, 0)
    return np.asarray(np.sqrt(x * x + y * y + z * z))
