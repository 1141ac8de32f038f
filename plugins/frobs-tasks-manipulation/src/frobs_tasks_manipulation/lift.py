"""Lifting task: grasp a cube and hold it in the air."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.description import Rewards, RewardTerm, Scene
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.own_object import OwnObject
from frobs_tasks_manipulation.rewards import APPROACH, GRIP, HELD, lifted, shaped
from frobs_tasks_manipulation.working_area import UP

_CONDITION = "the cube is between the fingers, in the air and moving slowly"


class Lift(ObjectTask):
    """Task of grasping a cube and holding it in the air.

    The success condition is that the bottom of the cube is between the heights ``lowest`` and ``highest``, and that the
    cube is between the fingers and moves slowly.

    The reward depends on the reward type:

    {rewards}

    Args:
        lowest: Minimum height of the cube's bottom above the floor at which the cube is considered lifted [m].
        highest: Maximum height of the cube's bottom at which the cube is considered lifted [m].
        object: Path of a mesh file (STL, OBJ or COLLADA) or of a URDF file without moving joints, or None for the cube.
        object_mass: Mass of the object [kg]. If None, it is read from a URDF file, or computed from the object's volume
            and a density of 1,000 kg/m³.
        object_scale: Factor for the lengths of the object, such as 0.001 for a mesh in millimeters.
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.manipulation.ObjectTask`.
    """

    replacing: ClassVar[Mapping[str, Sequence[str]]] = {"object": ("size", "mass")}
    raised_by: ClassVar[Sequence[str]] = ("lowest",)
    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.grasp:LiftCube"
    success_rule: ClassVar[str] = HELD + _CONDITION
    instruction: ClassVar[str] = "Pick up the cube and hold it in the air."
    rewards: ClassVar[Rewards] = shaped(
        _CONDITION,
        approach=APPROACH,
        grip=GRIP,
        lift=RewardTerm(
            function=lambda task: lifted(task, task.lowest),
            weight=0.8,
            meaning="min(h / lowest, 1), where h is the height of the cube's bottom",
        ),
    )
    reset_options: ClassVar[Sequence[str]] = ("cube_position",)
    shows_goal: ClassVar[bool] = False

    def __init__(
        self,
        *,
        lowest: float = 0.1,
        highest: float = 0.4,
        object: str | None = None,
        object_mass: float | None = None,
        object_scale: float = 1.0,
        **keywords: Any,
    ) -> None:
        super().__init__(**keywords)
        self.own_object = OwnObject.read(self, object, object_mass, object_scale)
        self.lowest, self.highest = positive("lowest", lowest, "m"), positive("highest", highest, "m")

    def scene(self) -> Scene:
        """Return a scene with the cube, or the object from a file, on the floor."""
        scene = super().scene()
        return scene if self.own_object is None else self.own_object.replace_in(scene, self.body_name)

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        return cube + self.lowest * UP

    def _is_achieved(self) -> Mask:
        height = self.cube.pos[:, 2] - self.rest_height
        lifted = (height >= self.lowest) & (height <= self.highest)
        held = self.to_cube <= max(self.size / 2, abs(self.grasp.closed_at))  # a fixed jaw is beside the tool
        return np.asarray(lifted & held & (self.speed <= self.max_speed))
