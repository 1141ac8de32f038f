"""Lifting task: grasp a cube and hold it in the air."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.cube_task import CubeTask
from frobs_tasks_manipulation.manipulation import UP
from frobs_tasks_manipulation.rewards import nearness


class Lift(CubeTask):
    """Task of grasping a cube and holding it in the air.

    The success condition is that the bottom of the cube is between the heights ``lowest`` and ``highest``, and that the
    cube is between the fingers and moves slowly.

    The reward depends on the reward type:

    - ``dense``: 0.2 · nearness of the tool to the cube + 0.3 · centering of the cube between the fingers + 0.8 ·
      lift height of the cube as a fraction of ``lowest`` + 0.5 if the success condition is met
    - ``sparse``: 0 if the success condition is met, otherwise −1

    Args:
        lowest: Minimum height of the cube's bottom above the floor at which the cube is considered lifted [m].
        highest: Maximum height of the cube's bottom at which the cube is considered lifted [m].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.cube_task.CubeTask`.
    """

    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.grasp:LiftCube"
    success_rule: ClassVar[str] = (
        "during the last hold_steps control steps before the time limit, "
        "the cube is between the fingers, in the air and moving slowly"
    )
    instruction: ClassVar[str] = "Pick up the cube and hold it in the air."
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.2 · (1 − tanh(d / 0.2 m)), where d is the distance from the tool to the cube",
        "grip": "0.3 · (1 − tanh(2 d / size)), where size is the edge length of the cube",
        "lift": "0.8 · min(h / lowest, 1), where h is the height of the cube's bottom",
        "achieved": "0.5 if the cube is between the fingers, in the air and moving slowly",
        "unachieved": "−1 unless the cube is between the fingers, in the air and moving slowly",
    }
    reset_options: ClassVar[Sequence[str]] = ("cube_position",)
    shows_goal: ClassVar[bool] = False

    def __init__(self, *, lowest: float = 0.1, highest: float = 0.4, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.lowest, self.highest = positive("lowest", lowest, "m"), positive("highest", highest, "m")

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        return cube + self.lowest * UP

    def _is_achieved(self) -> Mask:
        height = self.cube.pos[:, 2] - self.size / 2
        lifted = (height >= self.lowest) & (height <= self.highest)
        return np.asarray(lifted & (self.to_cube <= self.size / 2) & (self.speed <= self.max_speed))

    def _dense_terms(self) -> Mapping[str, Floats]:
        height = np.minimum(np.maximum(self.cube.pos[:, 2] - self.size / 2, 0.0), self.lowest)
        return {
            "approach": 0.2 * nearness(self.to_cube, 0.2),
            "grip": 0.3 * nearness(self.to_cube, self.size / 2),
            "lift": 0.8 / self.lowest * height,
            "achieved": np.where(self._is_achieved(), 0.5, 0.0),
        }
