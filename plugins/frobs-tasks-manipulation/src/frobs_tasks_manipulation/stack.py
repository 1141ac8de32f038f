"""Stacking task: put a cube on another cube and release it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from frobs_core.description import ObservationTerm, Scene
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.cube_task import CUBE, CubeTask
from frobs_tasks_manipulation.manipulation import UP
from frobs_tasks_manipulation.observed import bounded
from frobs_tasks_manipulation.rewards import length, nearness
from frobs_tasks_manipulation.tracked import Tracked

BASE = "base"
RED = (0.84, 0.24, 0.2, 1.0)
_APART = 2.5
"""Minimum distance between the centers of the two cubes at the start of an episode, in edge lengths."""


class Stack(CubeTask):
    """Task of putting a cube on another cube, releasing it, and moving the tool away.

    The success condition is that the cube is centered on the other cube, that both cubes are still, and that the
    distance between the tool and the cube is at least ``released``.

    The reward depends on the reward type:

    - ``dense``: 0.2 · nearness of the tool to the cube + 0.3 · centering of the cube between the fingers (or 0.5 in
      total if the cube is in its place on the other cube) + h · (0.2 + 0.6 · nearness of the cube to its place), where
      h is the lift height of the cube as a fraction of the cube's size, + 1 if the success condition is met. If the
      cube is in its place, + 0.25 · opening of the gripper + 0.75 · distance between the tool and the cube as a
      fraction of ``released``
    - ``sparse``: 0 if the success condition is met, otherwise −1

    The other parameters are those of :class:`~frobs_tasks_manipulation.cube_task.CubeTask`. The goal is the position on
    top of the other cube.

    Args:
        tolerance: Maximum distance between the cube's center and the goal at which the cube is in its place [m].
        released: Minimum distance between the tool and the cube at which the cube is considered released [m].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.cube_task.CubeTask`.
    """

    reset_options: ClassVar[Sequence[str]] = ("cube_position",)
    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.grasp:StackCube"
    success_rule: ClassVar[str] = (
        "during the last hold_steps control steps before the time limit, "
        "the cube is released on the other cube and both cubes are at rest"
    )
    instruction: ClassVar[str] = "Pick up the cube, put it on the other cube and move the gripper away."
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.2 · (1 − tanh(d / 0.2 m)), where d is the distance from the tool to the cube; "
        "0.2 if the cube is in its place",
        "grip": "0.3 · (1 − tanh(2 d / size)), where size is the edge length of the cube; "
        "0.3 if the cube is in its place",
        "lift": "0.2 · min(h / size, 1), where h is the height of the cube's bottom",
        "carry": "(0.6 − 0.2 · tanh(d / 0.2 m) − 0.4 · tanh(d / 0.03 m)) · min(h / size, 1), where d is the distance from "
        "the cube to its place",
        "release": "0.25 · opening of the gripper + 0.75 · min(d / released, 1) if the cube is in its place, where d "
        "is the distance from the tool to the cube",
        "achieved": "1 if the cube is released on the other cube and both cubes are at rest",
        "unachieved": "−1 unless the cube is released on the other cube and both cubes are at rest",
    }

    def __init__(self, *, tolerance: float = 0.02, released: float = 0.07, **keywords: float) -> None:
        super().__init__(tolerance=tolerance, **keywords)
        self.released = positive("released", released, "m")

    def scene(self) -> Scene:
        """Return a scene with two cubes on the floor."""
        scene = super().scene()
        base = replace(
            scene.bodies[CUBE], rgba=RED, pose=replace(scene.bodies[CUBE].pose, pos=(0.6, 0.1, self.size / 2))
        )
        return replace(scene, bodies={**scene.bodies, BASE: base})

    def _bind_objects(self) -> None:
        super()._bind_objects()
        self.base = Tracked(self._simulation.bodies[BASE])

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for the tool, both cubes, the offsets cube − tool and goal − cube, and the gripper.

        The term ``gripper_effort`` is the mean drive effort of the fingers as a fraction of its limit, < 0 if it closes
        them. While the fingers hold the cube, the gripper's opening does not show how far they are commanded to close;
        the effort does.
        """
        terms = super().observation_terms()
        return {
            **{name: term for name, term in terms.items() if name not in ("goal", "goal_offset")},
            **self.near_terms(),
            "gripper_effort": bounded(self._gripper_effort, 1, 1.5, "1", proprioceptive=True),
            **self.base.terms("base"),
            "goal_offset": terms["goal_offset"],
        }

    def _gripper_effort(self) -> Floats:
        shares = self._robot.joint_efforts[:, self._fingers] / self._robot.effort_limit[:, self._fingers]
        return np.asarray((shares * np.sign(self._stroke)).sum(axis=1, keepdims=True) / len(self._fingers))

    def markers(self) -> tuple[()]:
        """Return no markers, because the goal is the other cube."""
        return ()

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        super()._place_objects(mask, rng, options)
        self.base.body.write_pose(self._drawn_base, self.draw_turn("base_turn", rng, mask), mask)

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        self._drawn_base = self.draw_place(
            "base", rng, mask, height=self.size / 2, apart_from=cube, distance=_APART * self.size
        )
        return self._drawn_base + self.size * UP

    def _measure(self) -> None:
        self.base.read()
        self.goal[:] = self.base.pos + self.size * UP
        super()._measure()

    def _is_achieved(self) -> Mask:
        base_at_rest = length(self.base.velocity) <= self.max_speed
        return np.asarray(super()._is_achieved() & base_at_rest & (self.to_cube >= self.released))

    def _dense_terms(self) -> Mapping[str, Floats]:
        placed = self.to_goal <= self.tolerance
        height = np.minimum(np.maximum(self.cube.pos[:, 2] - self.size / 2, 0.0), self.size) / self.size
        near = 0.2 * nearness(self.to_goal, 0.2) + 0.4 * nearness(self.to_goal, 0.03)
        away = np.minimum(self.to_cube, self.released) / self.released
        return {
            "approach": np.where(placed, 0.2, 0.2 * nearness(self.to_cube, 0.2)),
            "grip": np.where(placed, 0.3, 0.3 * nearness(self.to_cube, self.size / 2)),
            "lift": 0.2 * height,
            "carry": near * height,  # pushing the cube over the floor must not pay
            "release": np.where(placed, 0.25 * np.clip(self.opening, 0.0, 1.0) + 0.75 * away, 0.0),
            "achieved": np.where(self._is_achieved(), 1.0, 0.0),
        }
