"""Goal-conditioned form of tasks with one object, for hindsight experience replay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from frobs_core.contracts import PositionGoalTask, distance_between, position_goal_rewards
from frobs_core.description import ObservationTerm, Rewards
from frobs_core.util.arrays import Floats, Mask
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.rewards import HELD
from frobs_tasks_manipulation.tracked import bounded, near_terms

_FARTHEST = 2.0  # [m] maximum absolute value of each observed coordinate, enforced by clipping


class GoalForm(ObjectTask, PositionGoalTask):
    """Base class that turns a task with one object into its goal-conditioned form.

    In a subclass, list this class before the plain task: ``class PushGoal(GoalForm, Push)``. The goal-conditioned form
    has the same scene, initial states and expert as the plain task. The observation is a dictionary of float32 arrays
    in SI units: ``observation`` (the terms of the plain task without the goal), ``achieved_goal`` (position of the
    object, 3) and ``desired_goal`` (3).

    Goals have no minimum distance from the object, because hindsight replay first learns from goals that are already
    reached.

    For the reward, see :class:`~frobs_core.contracts.PositionGoalTask`:

    {rewards}

    The success condition is d ≤ tolerance. The speed of the object does not matter.
    """

    rewards: ClassVar[Rewards] = position_goal_rewards("unachieved", "the object")
    success_rule: ClassVar[str] = f"{HELD}the object is within the tolerance of the goal"
    goal_clearance: ClassVar[float] = 0.0

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the terms of ``observation``, ``achieved_goal`` and ``desired_goal``."""
        terms = {**super().observation_terms(), **near_terms(self)}
        goals = {"achieved_goal": self.cube.pos, "desired_goal": self.goal}
        return {
            **{name: term for name, term in terms.items() if not name.startswith("goal")},
            **{key: replace(bounded(pos, _FARTHEST, "m", scale=4.0), key=key) for key, pos in goals.items()},
        }

    def _measure(self) -> None:
        super()._measure()
        self.goal_distance = distance_between(_observed(self.cube.pos), _observed(self.goal))  # (num_envs,) [m]

    def _is_achieved(self) -> Mask:
        return np.asarray(self.goal_distance <= self.tolerance)


def _observed(pos: Floats) -> npt.NDArray[np.float32]:
    """Return positions as in the observation, clipped and rounded to float32."""
    return np.clip(pos, -_FARTHEST, _FARTHEST).astype(np.float32)
