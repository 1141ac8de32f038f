"""Pick-and-place task: bring a cube to a goal on the floor or in the air."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ParameterValueError
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import non_negative, positive
from frobs_tasks_manipulation.cube_task import CubeTask
from frobs_tasks_manipulation.goal_form import GoalForm
from frobs_tasks_manipulation.rewards import nearness


class PickAndPlace(CubeTask):
    """Task of bringing a cube to a goal. By default, half of the goals are on the floor and half in the air.

    The success condition is that the cube's center is within the tolerance of the goal and that the cube moves slowly.

    The reward depends on the reward type:

    - ``dense``: 0.2 · nearness of the tool to the cube + 0.3 · centering of the cube between the fingers + 0.8 ·
      nearness of the cube to the goal + 0.3 · lift height of the cube as a fraction of 5 cm (only for goals in the air)
      + 0.5 if the success condition is met
    - ``sparse``: 0 if the success condition is met, otherwise −1

    Args:
        air_share: Fraction of the goals that are in the air, in [0, 1].
        highest: Maximum height of a goal above the floor [m].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.cube_task.CubeTask`.
    """

    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.grasp:CarryCube"
    success_rule: ClassVar[str] = (
        "during the last hold_steps control steps before the time limit, "
        "the cube is within the tolerance of the goal and moves slowly"
    )
    instruction: ClassVar[str] = "Pick up the cube and bring it to the goal."
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.2 · (1 − tanh(d / 0.2 m)), where d is the distance from the tool to the cube",
        "grip": "0.3 · (1 − tanh(2 d / size)), where size is the edge length of the cube",
        "carry": "0.8 · (1 − tanh(d / 0.25 m)), where d is the distance from the cube to the goal",
        "lift": "0.3 · min(h / 0.05 m, 1), where h is the height of the cube's bottom; only for goals in the air",
        "achieved": "0.5 if the cube is at the goal and moves slowly",
        "unachieved": "−1 unless the cube is at the goal and moves slowly",
    }

    def __init__(self, *, air_share: float = 0.5, highest: float = 0.25, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.air_share, self.highest = non_negative("air_share", air_share), positive("highest", highest, "m")
        if self.air_share > 1.0:
            raise ParameterValueError("air_share", air_share, "in [0, 1]")

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        goal = self.draw_floor_goal(cube, mask, rng)
        chance = rng.uniform("goal_in_air", mask=mask)
        height = rng.uniform("goal_height", 0.05, self.highest, mask=mask)
        goal[:, 2] += np.where(chance < self.air_share, height, 0.0)
        return goal

    def _dense_terms(self) -> Mapping[str, Floats]:
        height = np.minimum(np.maximum(self.cube.pos[:, 2] - self.size / 2, 0.0), 0.05)
        in_air = self.goal[:, 2] > self.size
        return {
            "approach": 0.2 * nearness(self.to_cube, 0.2),
            "grip": 0.3 * nearness(self.to_cube, self.size / 2),
            "carry": 0.8 * nearness(self.to_goal, 0.25),
            "lift": np.where(in_air, 0.3 / 0.05 * height, 0.0),
            "achieved": np.where(self._is_achieved(), 0.5, 0.0),
        }


class PickAndPlaceGoal(GoalForm, PickAndPlace):
    """Goal-conditioned task of bringing a cube to a goal on the floor or in the air.

    For the rewards and the observation, see :class:`~frobs_tasks_manipulation.goal_form.GoalForm`.

    Args:
        air_share: Fraction of the goals that are in the air, in [0, 1].
        highest: Maximum height of a goal above the floor [m].
        keywords: Further parameters, which are passed to :class:`PickAndPlace`.
    """

    def __init__(self, *, air_share: float = 0.7, highest: float = 0.2, **keywords: Any) -> None:
        super().__init__(air_share=air_share, highest=highest, **keywords)
