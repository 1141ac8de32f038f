"""Goal-conditioned form of tasks with one object, for hindsight experience replay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from frobs_core.contracts import GoalTask, StepContext
from frobs_core.description import ObservationTerm
from frobs_core.util.arrays import Floats, Mask
from frobs_tasks_manipulation.cube_task import CubeTask
from frobs_tasks_manipulation.observed import bounded

_FARTHEST = 2.0  # [m] maximum absolute value of each observed coordinate, enforced by clipping


class GoalForm(CubeTask, GoalTask):
    """Base class that turns a task with one object into its goal-conditioned form.

    In a subclass, list this class before the plain task: ``class PushGoal(GoalForm, Push)``. The goal-conditioned form
    has the same scene, initial states and expert as the plain task. The observation is a dictionary of float32 arrays
    in SI units: ``observation`` (the terms of the plain task without the goal), ``achieved_goal`` (position of the
    object, 3) and ``desired_goal`` (3).

    Goals have no minimum distance from the object, because hindsight replay first learns from goals that are already
    reached.

    The reward depends on the distance d between the achieved and the desired goal, both rounded to float32. The results
    of :meth:`reward` and of :meth:`compute_reward` for the observed goals are therefore bit-identical.

    - ``sparse``: 0 if d ≤ tolerance, otherwise −1
    - ``dense``: −d

    The success condition is d ≤ tolerance. The speed of the object does not matter.
    """

    reward_types: ClassVar[Sequence[str]] = ("sparse", "dense")
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "unachieved": "−1 if d > tolerance, else 0, where d is the distance from the object to the goal",
        "distance": "−d",
    }
    success_rule: ClassVar[str] = (
        "during the last hold_steps control steps before the time limit, the object is within the tolerance of the goal"
    )
    goal_clearance: ClassVar[float] = 0.0

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the terms of ``observation``, ``achieved_goal`` and ``desired_goal``."""
        terms = {**super().observation_terms(), **self.near_terms()}
        terms = {name: term for name, term in terms.items() if not name.startswith("goal")}
        achieved = bounded(lambda: self.cube.pos, 3, _FARTHEST, "m", scale=4.0)
        desired = bounded(lambda: self.goal, 3, _FARTHEST, "m", scale=4.0)
        return {
            **terms,
            "achieved_goal": replace(achieved, key="achieved_goal"),
            "desired_goal": replace(desired, key="desired_goal"),
        }

    def reward(self, context: StepContext) -> Floats:
        """Return the reward of each environment, (num_envs,)."""
        reward = self._reward_of(self._distance)
        self._reward_terms = {"unachieved" if self.reward_type == "sparse" else "distance": reward}
        return reward

    def compute_reward(self, achieved_goal: Floats, desired_goal: Floats, info: Any) -> Floats:
        """Compute the reward for achieved and desired goals, independently of the current state.

        Args:
            achieved_goal: Achieved goals, (..., 3) [m].
            desired_goal: Desired goals, (..., 3) [m].
            info: Ignored.

        Returns:
            The rewards, (...) float64.
        """
        return self._reward_of(_distance(achieved_goal, desired_goal))

    def _reward_of(self, distance: Floats) -> Floats:
        return np.where(distance <= self.tolerance, 0.0, -1.0) if self.reward_type == "sparse" else -distance

    def _measure(self) -> None:
        super()._measure()
        self._distance = _distance(_observed(self.cube.pos), _observed(self.goal))  # (num_envs,) [m]

    def _is_achieved(self) -> Mask:
        return np.asarray(self._distance <= self.tolerance)


def _observed(pos: Floats) -> npt.NDArray[np.float32]:
    """Return positions as in the observation, clipped and rounded to float32."""
    return np.clip(pos, -_FARTHEST, _FARTHEST).astype(np.float32)


def _distance(achieved_goal: npt.ArrayLike, desired_goal: npt.ArrayLike) -> Floats:
    """Return the distances (...) [m] as float64 between goals (..., 3) of any dtype and memory layout."""
    offset = np.asarray(desired_goal, np.float64) - np.asarray(achieved_goal, np.float64)
    # Add the columns one by one to fix the order of additions, so that the result is bit-identical for every shape.
    x, y, z = np.moveaxis(offset, -1, 0)
    return np.asarray(np.sqrt(x * x + y * y + z * z))
