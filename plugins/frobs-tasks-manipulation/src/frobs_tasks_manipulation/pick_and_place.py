"""Pick-and-place task: bring a cube to a goal on the floor or in the air."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.description import Rewards, RewardTerm, Scene
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ParameterValueError
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import non_negative, positive
from frobs_tasks_manipulation.goal_form import GoalForm
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.own_object import OwnObject
from frobs_tasks_manipulation.rewards import APPROACH, GRIP, HELD, lifted, nearness, shaped

_LOWEST = 0.06  # [m] minimum of the largest height for an object that is gripped high above the floor
_CONDITION = "the cube is within the tolerance of the goal and moves slowly"


class PickAndPlace(ObjectTask):
    """Task of bringing a cube to a goal. By default, half of the goals are on the floor and half in the air.

    The success condition is that the cube's center is within the tolerance of the goal and that the cube moves slowly.

    The reward depends on the reward type:

    {rewards}

    Args:
        air_share: Fraction of the goals that are in the air, in [0, 1].
        highest: Maximum height of a goal above the floor [m]. An object that is gripped high above the floor is lifted
            less.
        object: Path of a mesh file (STL, OBJ or COLLADA) or of a URDF file without moving joints, or None for the cube.
        object_mass: Mass of the object [kg]. If None, it is read from a URDF file, or computed from the object's volume
            and a density of 1,000 kg/m³.
        object_scale: Factor for the lengths of the object, such as 0.001 for a mesh in millimeters.
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.manipulation.ObjectTask`.
    """

    replacing: ClassVar[Mapping[str, Sequence[str]]] = {"object": ("size", "mass")}
    raised_by: ClassVar[Sequence[str]] = ("highest",)
    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.grasp:CarryCube"
    success_rule: ClassVar[str] = HELD + _CONDITION
    instruction: ClassVar[str] = "Pick up the cube and bring it to the goal."
    rewards: ClassVar[Rewards] = shaped(
        _CONDITION,
        approach=APPROACH,
        grip=GRIP,
        carry=RewardTerm(
            function=lambda task: nearness(task.to_goal, 0.25),
            weight=0.8,
            meaning="1 − tanh(d / 0.25 m), where d is the distance from the cube to the goal",
        ),
        lift=RewardTerm(
            function=lambda task: np.where(task.goal[:, 2] > task.rest_height + task.size / 2, lifted(task, 0.05), 0.0),
            weight=0.3,
            meaning="min(h / 0.05 m, 1), where h is the height of the cube's bottom; only for goals in the air",
        ),
    )

    def __init__(
        self,
        *,
        air_share: float = 0.5,
        highest: float = 0.25,
        object: str | None = None,
        object_mass: float | None = None,
        object_scale: float = 1.0,
        **keywords: Any,
    ) -> None:
        super().__init__(**keywords)
        self.own_object = OwnObject.read(self, object, object_mass, object_scale)
        self.air_share, self.highest = non_negative("air_share", air_share), positive("highest", highest, "m")
        if self.air_share > 1.0:
            raise ParameterValueError("air_share", air_share, "in [0, 1]")
        if self.own_object is not None:
            self.highest = max(self.highest - self.own_object.raised, min(self.highest, _LOWEST))

    def scene(self) -> Scene:
        """Return a scene with the cube, or the object from a file, on the floor."""
        scene = super().scene()
        return scene if self.own_object is None else self.own_object.replace_in(scene, self.body_name)

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        goal = super()._draw_goal(cube, mask, rng)
        chance = rng.uniform("goal_in_air", mask=mask)
        height = rng.uniform("goal_height", 0.05, self.highest, mask=mask)
        goal[:, 2] += np.where(chance < self.air_share, height, 0.0)
        return goal


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
