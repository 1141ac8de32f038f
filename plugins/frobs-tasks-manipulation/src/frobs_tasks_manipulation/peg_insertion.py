"""Peg insertion task: put a square peg into a square hole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from frobs_core.description import Body, Marker, ObservationTerm, Scene, Shape
from frobs_core.models import Box, Pose
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import matrix_from_quat
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.cube_task import CUBE, CubeTask
from frobs_tasks_manipulation.manipulation import UP
from frobs_tasks_manipulation.observed import bounded
from frobs_tasks_manipulation.rewards import length, nearness

BLOCK = "block"
_WALL, HEIGHT = 0.03, 0.05
"""Thickness and height of the walls around the hole [m]."""

_GRIP = 0.02
"""Height above the peg's center at which the tool grips the peg [m]. A low grip tilts the peg less."""

_CLOSE = 0.01
"""Largest observed horizontal distance from the peg's lower end to the hole's axis [m]."""

_OAK = (0.72, 0.52, 0.33, 1.0)


class PegInsertion(CubeTask):
    """Task of putting a square peg that stands on the floor into a square hole in a block.

    The success condition is that the peg is still and at least ``depth`` deep in the hole.

    The reward depends on the reward type:

    - ``dense``: 0.2 · nearness of the tool to its grip position on the peg + 0.3 · centering of the peg between the
      fingers + h · (0.2 + 0.3 · nearness of the peg to its place in the hole + 0.3 · alignment of the peg's lower end
      with the hole), where h is the lift height of the peg as a fraction of the block's height (or 1 if the peg is in or
      above the hole), + 0.5 if the success condition is met
    - ``sparse``: 0 if the success condition is met, otherwise −1

    Args:
        clearance: Edge length of the hole minus the edge length of the peg [m].
        size: Edge length of the peg [m].
        height: Height of the peg [m].
        depth: Minimum depth of the peg in the hole for success [m].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.cube_task.CubeTask`.
    """

    reset_options: ClassVar[Sequence[str]] = ("cube_position",)
    physics_timestep: ClassVar[float] = 0.002  # short, because an arm can press the peg into the floor
    late_terms: ClassVar[Sequence[str]] = ("peg_offset_near", "goal_offset_near", "goal_offset_of_end")
    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.insert:InsertPeg"
    success_rule: ClassVar[str] = (
        "during the last hold_steps control steps before the time limit, the peg is at rest and deep enough in the hole"
    )
    instruction: ClassVar[str] = "Pick up the peg and insert it into the hole."
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.2 · (1 − tanh(d / 0.2 m)), where d is the distance from the tool to the grip position on the "
        "peg",
        "grip": "0.3 · (1 − tanh(2 d / size)), where size is the edge length of the peg",
        "lift": "0.2 · min(h / height of the block, 1), where h is the height of the peg's lower end; "
        "0.2 if the peg is in or above the hole",
        "insert": "(0.6 − 0.3 · tanh(d / 0.2 m) − 0.15 · tanh(a / 0.01 m) − 0.15 · tanh(a / 0.002 m)) · "
        "min(h / height of the block, 1), where d is the distance from the peg to its place in the hole, and a is the "
        "horizontal distance from the peg's lower end to the hole's axis; without the last factor if the peg is in or "
        "above the hole",
        "achieved": "0.5 if the peg is at rest and deep enough in the hole",
        "unachieved": "−1 unless the peg is at rest and deep enough in the hole",
    }

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

    def scene(self) -> Scene:
        """Return a scene with a peg that stands on the floor and a block with a hole."""
        scene = super().scene()
        x, y = self.center.tolist()
        peg = replace(
            scene.bodies[CUBE], geometry=Box((self.size, self.size, self.height)), pose=Pose((x, y, self.height / 2))
        )
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
        terms = {**super().observation_terms(), **self.near_terms()}
        terms = {name.replace("cube", "peg"): term for name, term in terms.items()}
        return {
            **terms,
            "goal": bounded(lambda: self.goal[:, :2], 2, 2.0, "m", scale=4.0),
            "goal_offset_of_end": bounded(lambda: self.end_offset, 2, _CLOSE, "m", scale=1.0 / _CLOSE),
        }

    def markers(self) -> Sequence[Marker]:
        """Return a marker at the target position of the peg's center."""
        return (Marker(self.goal, 0.01),)

    @property
    def rest_height(self) -> float:
        """Height of the peg's center when the peg stands on the floor [m]."""
        return self.height / 2

    @property
    def grip(self) -> Floats:
        """Position at which the tool grips the peg, 2 cm above the peg's center, (num_envs, 3) [m]."""
        return np.asarray(self.cube.pos + _GRIP * UP)

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        super()._place_objects(mask, rng, options)
        self._simulation.bodies[BLOCK].write_pose(self._drawn_block, None, mask)

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        self._drawn_block = self.draw_place("block", rng, mask, height=0.0, apart_from=cube, distance=0.12)
        return np.asarray(self._drawn_block + self.height / 2 * UP)

    def _measure(self) -> None:
        super()._measure()
        down = matrix_from_quat(self.cube.quat_wxyz)[:, :, 2]
        self.end = self.cube.pos - self.height / 2 * down  # center of the lower end, (num_envs, 3) [m]
        self.end_offset = (self.goal - self.end)[:, :2]  # from the lower end to the hole's axis, (num_envs, 2) [m]

    def _is_achieved(self) -> Mask:
        offset = self.cube.pos - self.goal
        inside = (np.abs(offset[:, 0]) <= self.clearance + 0.002) & (np.abs(offset[:, 1]) <= self.clearance + 0.002)
        deep = (offset[:, 2] <= HEIGHT - self.depth) & (offset[:, 2] >= -0.005)
        return np.asarray(inside & deep & (self.speed <= self.max_speed))

    def _dense_terms(self) -> Mapping[str, Floats]:
        offset = self.cube.pos - self.goal
        above = (np.abs(offset[:, :2]) <= self.clearance + 0.002).all(axis=1)
        height = np.minimum(np.maximum(self.cube.pos[:, 2] - self.rest_height, 0.0), HEIGHT) / HEIGHT
        lifted = np.where(above, 1.0, height)
        aside = length(self.end_offset)
        near = 0.3 * nearness(self.to_goal, 0.2) + 0.15 * nearness(aside, 0.01) + 0.15 * nearness(aside, 0.002)
        return {
            "approach": 0.2 * nearness(self.to_cube, 0.2),
            "grip": 0.3 * nearness(self.to_cube, self.size / 2),
            "lift": 0.2 * lifted,
            "insert": near * lifted,  # pushing the peg over the floor must not pay
            "achieved": np.where(self._is_achieved(), 0.5, 0.0),
        }
