"""The goal-conditioned form of a task with one object, for hindsight experience replay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Floats, Mask
from frobs_core.interfaces import GoalTask, StepContext
from frobs_core.observation import ObservationTerm
from frobs_tasks_manipulation.cube_task import CubeTask
from frobs_tasks_manipulation.observed import bounded

_FARTHEST = 2.0  # [m] bound to which observed positions are clipped, along each axis


class GoalForm(CubeTask, GoalTask):
    """Base class that turns a task with one object into its goal-conditioned form.

    List it before the plain task: ``class PushGoal(GoalForm, Push)``. It keeps the plain task's scene, start and
    expert. The observation is a dictionary of float32 arrays in SI units: ``observation``, ``achieved_goal`` (position
    of the object, 3) and ``desired_goal`` (3). ``observation`` contains the terms of the plain task without the goal.

    Goals have no minimum distance from the object, because hindsight replay learns first from goals that are already
    reached.

    Reward, with d the distance between the two goals after rounding to float32, so that :meth:`reward` and the
    :meth:`compute_reward` of the observed goals are bit-identical:

    - ``sparse``: 0 if d ≤ tolerance, otherwise −1
    - ``dense``: −d

    The success condition is d ≤ tolerance; the speed of the object is ignored.
    """

    reward_types: ClassVar[Sequence[str]] = ("sparse", "dense")
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "unachieved": "−1 if d > tolerance, else 0, where d is the distance from the object to the goal",
        "distance": "−d",
    }
    success_rule: ClassVar[str] = (
        "at the time limit, the object has been within the tolerance of the goal for the last hold_steps"
    )
    goal_clearance: ClassVar[float] = 0.0

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the terms of the plain task without the goal, and the keys for both goals."""
        terms = {name: term for name, term in super().observation_terms().items() if not name.startswith("goal")}
        achieved = bounded(lambda: self.cube.pos, 3, _FARTHEST, "m", scale=4.0)
        desired = bounded(lambda: self.goal, 3, _FARTHEST, "m", scale=4.0)
        return {
            **terms,
            "achieved_goal": replace(achieved, key="achieved_goal"),
            "desired_goal": replace(desired, key="desired_goal"),
        }

    def reward(self, context: StepContext) -> Floats:
        """Return the reward, (num_envs,)."""
        reward = self._reward_of(self._distance)
        self._reward_terms = {"unachieved" if self.reward_type == "sparse" else "distance": reward}
        return reward

    def compute_reward(self, achieved_goal: Floats, desired_goal: Floats, info: Any) -> Floats:
        """Return the reward for given goals, independently of the environment's state.

        Args:
            achieved_goal: (..., 3) [m]
            desired_goal: (..., 3) [m]
            info: Ignored.

        Returns:
            (...) float64.
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
    """Return positions as they appear in the observation: clipped and rounded."""
    return np.clip(pos, -_FARTHEST, _FARTHEST).astype(np.float32)


def _distance(achieved_goal: npt.ArrayLike, desired_goal: npt.ArrayLike) -> Floats:
    """Return the distance (...) float64 [m] between goals (..., 3) of any dtype and memory layout."""
    offset = np.asarray(desired_goal, np.float64) - np.asarray(achieved_goal, np.float64)
    # Adding the columns one by one fixes the order of additions, so the result is bit-identical for every shape.
    x, y, z = np.moveaxis(offset, -1, 0)
    return np.asarray(np.sqrt(x * x + y * y + z * z))
