"""Push: move a cube across the floor to a goal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.observation import ObservationTerm
from frobs_core.random import RandomSource
from frobs_tasks_manipulation.cube_task import CubeTask
from frobs_tasks_manipulation.goal_form import GoalForm
from frobs_tasks_manipulation.observed import bounded
from frobs_tasks_manipulation.rewards import nearness


class Push(CubeTask):
    """Push a cube to a goal on the floor. The gripper is closed at the start.

    The condition of success: the cube's center is within the tolerance of the goal, and the cube is still.

    Reward, with d the distance from cube to goal:

    - ``dense``: 0.2 · nearness of the tool to the cube + 0.8 · nearness of the cube to the goal + 0.5 if the condition
      is met
    - ``sparse``: 0 if the condition is met, else −1

    The parameters are those of :class:`~frobs_tasks_manipulation.cube_task.CubeTask`.
    """

    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.push:PushCube"
    success_rule: ClassVar[str] = (
        "the cube has been within the tolerance of the goal, and still, for the last hold_steps when the time limit ends "
        "the episode"
    )
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.2 · (1 − tanh(d / 0.2 m)), d being the distance from tool to cube",
        "push": "0.8 · (1 − tanh(d / 0.15 m)), d being the distance from cube to goal",
        "achieved": "0.5 where the cube is at the goal and still",
        "unachieved": "−1 where it is not",
    }
    start_opening: ClassVar[float] = 0.0

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the terms of the tool, the cube, the goal on the floor (x, y), and cube − tool and goal − cube."""
        goal = bounded(lambda: self.goal[:, :2], 2, 2.0, "m", scale=4.0)
        return {**super().observation_terms(), "goal": goal}

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        return self.draw_floor_goal(cube, mask, rng)

    def _dense_terms(self) -> Mapping[str, Floats]:
        return {
            "approach": 0.2 * nearness(self.to_cube, 0.2),
            "push": 0.8 * nearness(self.to_goal, 0.15),
            "achieved": np.where(self._is_achieved(), 0.5, 0.0),
        }


class PushGoal(GoalForm, Push):
    """Push a cube to a goal on the floor, goal-conditioned: rewards and observation are those of :class:`GoalForm`."""
