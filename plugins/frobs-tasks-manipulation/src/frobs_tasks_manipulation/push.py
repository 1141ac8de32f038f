"""Pushing task: move a cube across the floor to a goal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from frobs_core.description import ObservationTerm
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_tasks_manipulation.cube_task import CubeTask
from frobs_tasks_manipulation.goal_form import GoalForm
from frobs_tasks_manipulation.observed import bounded
from frobs_tasks_manipulation.rewards import length, nearness

_BEHIND = 0.02
"""Distance between the cube and the point from which the tool pushes the cube toward the goal [m]."""


class Push(CubeTask):
    """Task of pushing a cube to a goal on the floor. The gripper is closed at the start of an episode.

    The success condition is that the cube's center is within the tolerance of the goal and that the cube is still.

    The reward depends on the reward type:

    - ``dense``: 0.3 · nearness of the tool to a point behind the cube, as seen from the goal (or 0.3 if the cube is at
      the goal) + 0.7 · nearness of the cube to the goal + 0.5 if the success condition is met
    - ``sparse``: 0 if the success condition is met, otherwise −1

    The parameters are the same as those of :class:`~frobs_tasks_manipulation.cube_task.CubeTask`.
    """

    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.push:PushCube"
    success_rule: ClassVar[str] = (
        "during the last hold_steps control steps before the time limit, "
        "the cube is within the tolerance of the goal and at rest"
    )
    instruction: ClassVar[str] = "Push the cube across the floor to the goal."
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.3 · (1 − tanh(d / 0.2 m)), where d is the distance from the tool to a point 2 cm behind the "
        "cube; 0.3 if the cube is at the goal",
        "push": "0.7 · (1 − tanh(d / 0.15 m)), where d is the distance from the cube to the goal",
        "achieved": "0.5 if the cube is at the goal and at rest",
        "unachieved": "−1 unless the cube is at the goal and at rest",
    }
    start_opening: ClassVar[float] = 0.0

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for tool, cube, goal (x, y), cube − tool and goal − cube."""
        goal = bounded(lambda: self.goal[:, :2], 2, 2.0, "m", scale=4.0)
        return {**super().observation_terms(), "goal": goal}

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        return self.draw_floor_goal(cube, mask, rng)

    def _dense_terms(self) -> Mapping[str, Floats]:
        way = (self.cube.pos - self.goal) / np.maximum(self.to_goal, 1e-6)[:, None]
        to_start = length(self.cube.pos + (self.size / 2 + _BEHIND) * way - self.tcp)
        return {
            "approach": np.where(self.to_goal <= self.tolerance, 0.3, 0.3 * nearness(to_start, 0.2)),
            "push": 0.7 * nearness(self.to_goal, 0.15),
            "achieved": np.where(self._is_achieved(), 0.5, 0.0),
        }


class PushGoal(GoalForm, Push):
    """Goal-conditioned task of pushing a cube to a goal on the floor.

    For the rewards and the observation, see :class:`~frobs_tasks_manipulation.goal_form.GoalForm`.
    """
