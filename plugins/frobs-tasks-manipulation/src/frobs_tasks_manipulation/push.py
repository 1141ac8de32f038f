"""Pushing task: move a cube across the floor to a goal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from frobs_core.description import ObservationTerm, Rewards, RewardTerm
from frobs_core.util.arrays import Floats
from frobs_tasks_manipulation.goal_form import GoalForm
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.rewards import HELD, length, nearness, shaped
from frobs_tasks_manipulation.tracked import bounded

_BEHIND = 0.02
"""Distance between the cube and the point from which the tool pushes the cube toward the goal [m]."""


_CONDITION = "the cube is within the tolerance of the goal and at rest"


def _approach(task: Push) -> Floats:
    way = (task.cube.pos - task.goal) / np.maximum(task.to_goal, 1e-6)[:, None]
    to_start = length(task.cube.pos + (task.size / 2 + _BEHIND) * way - task.tool.pos)
    return np.where(task.to_goal <= task.tolerance, 1.0, nearness(to_start, 0.2))


class Push(ObjectTask):
    """Task of pushing a cube to a goal on the floor. The gripper is closed at the start of an episode.

    The success condition is that the cube's center is within the tolerance of the goal and that the cube is still.

    The reward depends on the reward type:

    {rewards}

    The parameters are the same as those of :class:`~frobs_tasks_manipulation.manipulation.ObjectTask`.
    """

    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.push:PushCube"
    success_rule: ClassVar[str] = HELD + _CONDITION
    instruction: ClassVar[str] = "Push the cube across the floor to the goal."
    rewards: ClassVar[Rewards] = shaped(
        _CONDITION,
        approach=RewardTerm(
            function=_approach,
            weight=0.3,
            meaning="1 − tanh(d / 0.2 m), where d is the distance from the tool to a point 2 cm behind the cube, as "
            "seen from the goal; 0.3 if the cube is at the goal",
        ),
        push=RewardTerm(
            function=lambda task: nearness(task.to_goal, 0.15),
            weight=0.7,
            meaning="1 − tanh(d / 0.15 m), where d is the distance from the cube to the goal",
        ),
    )
    start_opening: ClassVar[float] = 0.0

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for tool, cube, goal (x, y), cube − tool and goal − cube."""
        goal = bounded(self.goal[:, :2], 2.0, "m", scale=4.0)
        return {**super().observation_terms(), "goal": goal}


class PushGoal(GoalForm, Push):
    """Goal-conditioned task of pushing a cube to a goal on the floor.

    For the rewards and the observation, see :class:`~frobs_tasks_manipulation.goal_form.GoalForm`.
    """
