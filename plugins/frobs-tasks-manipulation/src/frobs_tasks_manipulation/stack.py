"""Stacking task: put a cube on another cube and release it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from frobs_core.description import ObservationTerm, Rewards, RewardTerm, Scene
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.manipulation import CUBE, ObjectTask
from frobs_tasks_manipulation.rewards import APPROACH, GRIP, HELD, length, lifted, nearness, shaped
from frobs_tasks_manipulation.tracked import Tracked, bounded, near_terms
from frobs_tasks_manipulation.working_area import UP, draw_turn

BASE = "base"
RED = (0.84, 0.24, 0.2, 1.0)
_APART = 2.5
"""Minimum distance between the centers of the two cubes at the start of an episode, in edge lengths."""


_CONDITION = "the cube is released on the other cube and both cubes are at rest"


def _release(task: Stack) -> Floats:
    away = np.minimum(task.to_cube, task.released) / task.released
    return np.where(task.is_placed, 0.25 * np.clip(task.tool.opening, 0.0, 1.0) + 0.75 * away, 0.0)


class Stack(ObjectTask):
    """Task of putting a cube on another cube, releasing it, and moving the tool away.

    The success condition is that the cube is centered on the other cube, that both cubes are still, and that the
    distance between the tool and the cube is at least ``released``.

    The reward depends on the reward type:

    {rewards}

    The other parameters are those of :class:`~frobs_tasks_manipulation.manipulation.ObjectTask`. The goal is the position on
    top of the other cube.

    Args:
        tolerance: Maximum distance between the cube's center and the goal at which the cube is in its place [m].
        released: Minimum distance between the tool and the cube at which the cube is considered released [m].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.manipulation.ObjectTask`.
    """

    reset_options: ClassVar[Sequence[str]] = ("cube_position",)
    raised_by: ClassVar[Sequence[str]] = ("size",)
    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.grasp:StackCube"
    success_rule: ClassVar[str] = HELD + _CONDITION
    instruction: ClassVar[str] = "Pick up the cube, put it on the other cube and move the gripper away."
    rewards: ClassVar[Rewards] = shaped(
        _CONDITION,
        bonus=1.0,
        approach=RewardTerm(
            function=lambda task: np.where(task.is_placed, 1.0, nearness(task.to_cube, 0.2)),
            weight=0.2,
            meaning=f"{APPROACH.meaning}; 0.2 if the cube is in its place",
        ),
        grip=RewardTerm(
            function=lambda task: np.where(task.is_placed, 1.0, nearness(task.to_cube, task.size / 2)),
            weight=0.3,
            meaning=f"{GRIP.meaning}; 0.3 if the cube is in its place",
        ),
        lift=RewardTerm(
            function=lambda task: lifted(task, task.size),
            weight=0.2,
            meaning="min(h / size, 1), where h is the height of the cube's bottom",
        ),
        # The factor for the height is there because pushing the cube over the floor must not pay.
        carry=RewardTerm(
            function=lambda task: (
                (0.2 * nearness(task.to_goal, 0.2) + 0.4 * nearness(task.to_goal, 0.03)) * lifted(task, task.size)
            ),
            meaning="(0.6 − 0.2 · tanh(d / 0.2 m) − 0.4 · tanh(d / 0.03 m)) · min(h / size, 1), where d is the distance "
            "from the cube to its place",
        ),
        release=RewardTerm(
            function=_release,
            meaning="0.25 · opening of the gripper + 0.75 · min(d / released, 1) if the cube is in its place, where d "
            "is the distance from the tool to the cube",
        ),
    )

    def __init__(self, *, tolerance: float = 0.02, released: float = 0.07, **keywords: float) -> None:
        super().__init__(tolerance=tolerance, **keywords)
        self.released = positive("released", released, "m")

    @property
    def least_area(self) -> float:
        """Side length of the working area that has room for both cubes [m]."""
        return 1.5 * self.size

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
        self._effort = np.zeros((self.num_envs, 1))

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for the tool, both cubes, the offsets cube − tool and goal − cube, and the gripper.

        The term ``gripper_effort`` is the mean drive effort of the fingers as a fraction of its limit, < 0 if it closes
        them. While the fingers hold the cube, the gripper's opening does not show how far they are commanded to close;
        the effort does.
        """
        terms = super().observation_terms()
        return {
            **{name: term for name, term in terms.items() if name not in ("goal", "goal_offset")},
            **near_terms(self),
            "gripper_effort": bounded(self._effort, 1.5, "1", proprioceptive=True),
            **self.base.terms("base"),
            "goal_offset": terms["goal_offset"],
        }

    def markers(self) -> tuple[()]:
        """Return no markers, because the goal is the other cube."""
        return ()

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        super()._place_objects(mask, rng, options)
        turn = self.grasp.turned(draw_turn("base_turn", rng, mask), self._drawn_base)
        self.base.body.write_pose(self._drawn_base, turn, mask)

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        self._drawn_base = self.working_area.draw(
            "base", rng, mask, height=self.size / 2, apart_from=cube, distance=_APART * self.size
        )
        return self._drawn_base + self.size * UP

    def _measure(self) -> None:
        self.base.read()
        self.goal[:] = self.base.pos + self.size * UP
        super()._measure()
        self.is_placed = self.to_goal <= self.tolerance
        self._effort[:] = self.tool.read_effort()

    def _is_achieved(self) -> Mask:
        base_at_rest = length(self.base.velocity) <= self.max_speed
        return np.asarray(super()._is_achieved() & base_at_rest & (self.to_cube >= self.released))
