"""Peg insertion task: put a square peg into a square hole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from frobs_core.description import Body, Marker, ObservationTerm, Rewards, RewardTerm, Scene, Shape
from frobs_core.models import Box, Pose
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import matrix_from_quat
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.manipulation import CUBE, ObjectTask
from frobs_tasks_manipulation.rewards import APPROACH, GRIP, HELD, length, lifted, nearness, shaped
from frobs_tasks_manipulation.tracked import bounded, near_terms
from frobs_tasks_manipulation.working_area import UP

BLOCK = "block"
_WALL, HEIGHT = 0.03, 0.05
"""Thickness and height of the walls around the hole [m]."""

_GRIP = 0.02
"""Height above the peg's center at which the tool grips the peg [m]. A low grip tilts the peg less."""

_CLOSE = 0.01
"""Largest observed horizontal distance from the peg's lower end to the hole's axis [m]."""

_OAK = (0.72, 0.52, 0.33, 1.0)


_CONDITION = "the peg is at rest and deep enough in the hole"


def _insert(task: PegInsertion) -> Floats:
    aside = length(task.end_offset)
    near = 0.3 * nearness(task.to_goal, 0.2) + 0.15 * nearness(aside, 0.01) + 0.15 * nearness(aside, 0.002)
    return near * task.lifted  # pushing the peg over the floor must not pay


class PegInsertion(ObjectTask):
    """Task of putting a square peg that stands on the floor into a square hole in a block.

    The success condition is that the peg is still and at least ``depth`` deep in the hole.

    The reward depends on the reward type:

    {rewards}

    Args:
        clearance: Edge length of the hole minus the edge length of the peg [m].
        size: Edge length of the peg [m].
        height: Height of the peg [m].
        depth: Minimum depth of the peg in the hole for success [m].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.manipulation.ObjectTask`.
    """

    reset_options: ClassVar[Sequence[str]] = ("cube_position",)
    least_area: ClassVar[float] = 0.09  # [m], with room for the peg and the block
    physics_timestep: ClassVar[float] = 0.002  # short, because an arm can press the peg into the floor
    late_terms: ClassVar[Sequence[str]] = ("peg_offset_near", "goal_offset_near", "goal_offset_of_end")
    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.insert:InsertPeg"
    success_rule: ClassVar[str] = HELD + _CONDITION
    instruction: ClassVar[str] = "Pick up the peg and insert it into the hole."
    rewards: ClassVar[Rewards] = shaped(
        _CONDITION,
        approach=replace(
            APPROACH,
            meaning="1 − tanh(d / 0.2 m), where d is the distance from the tool to the grip position on the peg",
        ),
        grip=replace(GRIP, meaning="1 − tanh(2 d / size), where size is the edge length of the peg"),
        lift=RewardTerm(
            function=lambda task: task.lifted,
            weight=0.2,
            meaning="min(h / height of the block, 1), where h is the height of the peg's lower end; "
            "0.2 if the peg is in or above the hole",
        ),
        insert=RewardTerm(
            function=_insert,
            meaning="(0.6 − 0.3 · tanh(d / 0.2 m) − 0.15 · tanh(a / 0.01 m) − 0.15 · tanh(a / 0.002 m)) · min(h / height "
            "of the block, 1), where d is the distance from the peg to its place in the hole, and a is the horizontal "
            "distance from the peg's lower end to the hole's axis; without the last factor if the peg is in or above "
            "the hole",
        ),
    )

    def __init__(
        self,
        *,
        clearance: float = 0.002,
        size: float = 0.04,
        height: float = 0.1,
        depth: float = 0.03,
        **keywords: Any,
    ) -> None:
        super().__init__(size=size, **keywords)
        self.clearance = positive("clearance", clearance, "m")
        self.height, self.depth = positive("height", height, "m"), positive("depth", depth, "m")
        self.rest_height = self.height / 2

    def scene(self) -> Scene:
        """Return a scene with a peg that stands on the floor and a block with a hole."""
        scene = super().scene()
        x, y = self.center.tolist()
        peg = replace(scene.bodies[CUBE], geometry=Box((self.size, self.size, self.height)))
        hole = self.size + self.clearance
        middle, long = (hole + _WALL) / 2, hole + 2 * _WALL
        walls = [Shape(Box((_WALL, long, HEIGHT)), Pose((side * middle, 0.0, HEIGHT / 2))) for side in (-1.0, 1.0)] + [
            Shape(Box((hole, _WALL, HEIGHT)), Pose((0.0, side * middle, HEIGHT / 2))) for side in (-1.0, 1.0)
        ]
        block = Body(
            shapes=tuple(walls), pose=Pose((x, y + 0.1, 0.0)), kinematic=True, friction=self.friction, rgba=_OAK
        )
        return replace(scene, bodies={CUBE: peg, BLOCK: block})

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for tool, peg, hole (x, y), grip − tool, goal − peg and hole − lower end."""
        terms = {**super().observation_terms(), **near_terms(self)}
        terms = {name.replace("cube", "peg"): term for name, term in terms.items()}
        return {
            **terms,
            "goal": bounded(self.goal[:, :2], 2.0, "m", scale=4.0),
            "goal_offset_of_end": bounded(self.end_offset, _CLOSE, "m", scale=1.0 / _CLOSE),
        }

    def markers(self) -> Sequence[Marker]:
        """Return a marker at the target position of the peg's center."""
        return (Marker(self.goal, 0.01),)

    @property
    def grip(self) -> Floats:
        """Position at which the tool grips the peg, 2 cm above the peg's center, (num_envs, 3) [m]."""
        return np.asarray(self.cube.pos + _GRIP * UP)

    def _bind_objects(self) -> None:
        super()._bind_objects()
        self.end_offset = np.zeros((self.num_envs, 2))

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        super()._place_objects(mask, rng, options)
        self._simulation.bodies[BLOCK].write_pose(self._drawn_block, None, mask)

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        self._drawn_block = self.working_area.draw("block", rng, mask, height=0.0, apart_from=cube, distance=0.12)
        return np.asarray(self._drawn_block + self.height / 2 * UP)

    def _measure(self) -> None:
        super()._measure()
        down = matrix_from_quat(self.cube.quat_wxyz)[:, :, 2]
        self.end = self.cube.pos - self.height / 2 * down  # center of the lower end, (num_envs, 3) [m]
        self.end_offset[:] = (self.goal - self.end)[:, :2]  # from the lower end to the hole's axis, (num_envs, 2) [m]
        aside = np.abs(self.cube.pos - self.goal)[:, :2]
        self.is_above = (aside <= self.clearance + 0.002).all(axis=1)  # above the hole or in it, (num_envs,) bool
        self.lifted = np.where(self.is_above, 1.0, lifted(self, HEIGHT))  # fraction of the block's height, (num_envs,)

    def _is_achieved(self) -> Mask:
        height = self.cube.pos[:, 2] - self.goal[:, 2]
        deep = (height <= HEIGHT - self.depth) & (height >= -0.005)
        return np.asarray(self.is_above & deep & (self.speed <= self.max_speed))
