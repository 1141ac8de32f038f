"""Sliding task: hit a puck so that it slides to a goal out of reach."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from frobs_core.description import Camera, ObservationTerm, Rewards, RewardTerm, Scene
from frobs_core.models import Cylinder
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ParameterValueError
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.goal_form import GoalForm
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.rewards import HELD, length, nearness, shaped
from frobs_tasks_manipulation.tracked import bounded, near_terms

PUCK = "puck"
GRAVITY = 9.81
"""Gravitational acceleration [m/s²]."""


_CONDITION = "the puck is within the tolerance of the goal and moves slowly"


class Slide(ObjectTask):
    """Task of hitting a puck on a slippery floor so that the puck slides to a goal out of reach.

    At the start of an episode, the gripper is closed and the puck is in the working area. Goals are drawn uniformly
    from a rectangle that is beyond the working area in the direction of the world's x axis. The success condition is
    that the puck's center is within the tolerance of the goal and that the puck moves slowly.

    The reward depends on the reward type:

    {rewards}

    Args:
        size: Diameter of the puck [m].
        height: Height of the puck [m].
        friction: Sliding friction coefficient of the puck and the floor.
        nearest: Minimum distance along x between goals and the center of the working area [m].
        farthest: Maximum distance along x between goals and the center of the working area [m], > ``nearest``.
        width: Width of the goal rectangle along y [m].
        center: Center (x, y) of the working area on the floor, in the world frame [m].
        area: Side length of the square working area in which the puck is placed [m].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.manipulation.ObjectTask`.

    Raises:
        ConfigurationError: A value is out of range.
    """

    reset_options: ClassVar[Sequence[str]] = ("puck_position", "goal")
    expert: ClassVar[str] = "frobs_tasks_manipulation.experts.slide:SlidePuck"
    success_rule: ClassVar[str] = HELD + _CONDITION
    instruction: ClassVar[str] = "Hit the puck so that it slides to the goal."
    rewards: ClassVar[Rewards] = shaped(
        _CONDITION,
        approach=RewardTerm(
            function=lambda task: np.where(task.is_gone, 1.0, nearness(task.to_cube, 0.2)),
            weight=0.2,
            meaning="1 − tanh(d / 0.2 m), where d is the distance from the tool to the puck; 0.2 once the puck has left "
            "the working area",
        ),
        slide=RewardTerm(
            function=lambda task: 0.4 * nearness(task.missing, 0.3) + 0.4 * nearness(task.missing, 0.05),
            meaning="0.8 − 0.4 · tanh(d / 0.3 m) − 0.4 · tanh(d / 0.05 m), where d is the distance from the goal to the "
            "place where the puck will come to rest",
        ),
    )
    physics_timestep: ClassVar[float] = 0.002  # half of the usual timestep, because the tool and the puck are fast
    late_terms: ClassVar[Sequence[str]] = ("puck_offset_near", "goal_offset_near")
    start_opening: ClassVar[float] = 0.0
    body_name: ClassVar[str] = PUCK
    least_area: ClassVar[float] = 0.0  # the goals are elsewhere

    def __init__(
        self,
        *,
        size: float = 0.06,
        height: float = 0.03,
        friction: float = 0.03,
        nearest: float = 0.4,
        farthest: float = 0.6,
        width: float = 0.3,
        center: Sequence[float] = (0.45, 0.0),
        area: float = 0.2,
        **keywords: Any,
    ) -> None:
        super().__init__(size=size, friction=friction, center=center, area=area, **keywords)
        self.height = positive("height", height, "m")
        self.rest_height = self.height / 2
        self.nearest, self.width = positive("nearest", nearest, "m"), positive("width", width, "m")
        self.farthest = positive("farthest", farthest, "m")
        if self.farthest <= self.nearest:
            raise ParameterValueError("farthest", farthest, f"above nearest={nearest:g} m")

    @property
    def is_gone(self) -> Mask:
        """Whether the puck has left the working area in the direction of the goals, (num_envs,) bool."""
        return np.asarray(self.cube.pos[:, 0] > self.center[0] + (self.area / 2 + self.nearest) / 2)

    def scene(self) -> Scene:
        """Return a scene with a puck on a slippery floor."""
        scene = super().scene()
        puck = replace(scene.bodies[PUCK], geometry=Cylinder(self.size / 2, self.height))
        return replace(scene, floor_friction=self.friction, bodies={PUCK: puck})

    def cameras(self) -> dict[str, Camera]:
        """Return a camera that views the working area and the goals from the right."""
        x, y = self.center.tolist()
        return {"overview": Camera(pos=(x + 0.7, y - 1.3, 0.75), target=(x + 0.1, y, 0.15), fov_y=38.0)}

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for tool, puck, goal (x, y), puck − tool, goal − puck and goal − resting place."""
        goal = bounded(self.goal[:, :2], 2.0, "m", scale=4.0)
        rest = bounded(self.rest_offset, 2.0, "m", scale=5.0)
        return {**super().observation_terms(), **near_terms(self), "goal": goal, "goal_offset_at_rest": rest}

    def _bind_objects(self) -> None:
        super()._bind_objects()
        self.rest_offset = np.zeros((self.num_envs, 2))

    def _measure(self) -> None:
        super()._measure()
        velocity = self.cube.velocity[:, :2]
        slide = length(velocity)[:, None] * velocity / (2.0 * self.friction * GRAVITY)  # v² / (2 μ g)
        # from the place where the puck will come to rest, if nothing touches it, to the goal, (num_envs, 2) [m]
        self.rest_offset[:] = self.goal[:, :2] - self.cube.pos[:, :2] - slide
        self.missing = length(self.rest_offset)  # (num_envs,) [m]

    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        x = self.center[0] + rng.uniform("goal_x", self.nearest, self.farthest, (), mask)
        y = self.center[1] + rng.uniform("goal_y", -self.width / 2, self.width / 2, (), mask)
        return np.stack([x, y, np.full(len(x), self.rest_height)], axis=1)


class SlideGoal(GoalForm, Slide):
    """Goal-conditioned task of hitting a puck so that the puck slides to a goal.

    For the rewards and the observation, see :class:`~frobs_tasks_manipulation.goal_form.GoalForm`.
    """
