"""Pick up a dumbbell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.interfaces import Body, Contact, Scene, Shape
from frobs_core.models import Box, Pose
from frobs_core.observation import ObservationTerm
from frobs_core.random import RandomSource
from frobs_tasks_manipulation.manipulation import FLOOR_FRICTION, Manipulation
from frobs_tasks_manipulation.rewards import length, nearness
from frobs_tasks_manipulation.tracked import Tracked

RADIUS = 0.025  # half of the edge length of the plates [m]
PART = Body(
    shapes=(
        Shape(Box((0.10, 0.02, 0.02)), rgba=(0.8, 0.6, 0.2, 1.0)),
        Shape(Box((0.02, 2 * RADIUS, 2 * RADIUS)), Pose((0.05, 0.0, 0.0))),
        Shape(Box((0.02, 2 * RADIUS, 2 * RADIUS)), Pose((-0.05, 0.0, 0.0))),
    ),
    pose=Pose((0.35, 0.0, RADIUS)),
    mass=0.2,
    friction=0.6,
    rgba=(0.2, 0.3, 0.5, 1.0),
)


class LiftPart(Manipulation):
    """Pick up a dumbbell, and hold it above the floor.

    Args:
        height: Of the dumbbell's middle above the floor that counts as lifted [m].
        keywords: Those of :class:`~frobs_tasks_manipulation.manipulation.Manipulation`.
    """

    expert: ClassVar[str] = "frobs_tasks_lift_part.expert:LiftPartExpert"
    success_rule: ClassVar[str] = (
        "the dumbbell has been in the air, between the fingers and slow for hold_steps at the end"
    )
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "approach": "0.3 · (1 − tanh(d / 0.2 m)), d being the distance from tool to dumbbell",
        "lift": "0.7 · the share of the height",
        "achieved": "0.5 where the condition is met",
        "unachieved": "−1 where it is not",
    }

    def __init__(
        self, *, center: Sequence[float] = (0.35, 0.0), area: float = 0.15, height: float = 0.15, **keywords: Any
    ) -> None:
        super().__init__(center=center, area=area, **keywords)
        self.height = height

    def scene(self) -> Scene:
        """Return a floor, the dumbbell, and the contact between them."""
        return Scene(
            hard_contacts=True,
            floor_friction=FLOOR_FRICTION,
            bodies={"part": PART},
            contacts={"lying": Contact(first="part", second="floor")},
            cameras=self.cameras(),
        )

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the terms of the tool and the dumbbell, and dumbbell − tool."""
        offset = ObservationTerm(
            read=lambda: np.clip(self.part.pos - self.tcp, -2.0, 2.0),
            low=np.full(3, -2.0),
            high=np.full(3, 2.0),
            unit="m",
            scale=5.0,
        )
        return {**self.tool_terms(), **self.part.terms("part"), "part_offset": offset}

    def _bind_objects(self) -> None:
        self.part = Tracked(self._simulation.bodies["part"])

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        place = self.draw_place("part", rng, mask, height=RADIUS)
        self.part.body.write_pose(place, self.draw_turn("part_turn", rng, mask), mask)

    def _measure(self) -> None:
        super()._measure()
        self.part.read()
        self.to_part = length(self.part.pos - self.tcp)  # (num_envs,) [m]

    def _is_achieved(self) -> Mask:
        lifted = (self.part.pos[:, 2] >= self.height) & ~self._simulation.contact("lying")
        return lifted & (self.to_part < RADIUS) & (length(self.part.velocity) < 0.2)

    def _dense_terms(self) -> Mapping[str, Floats]:
        share = np.clip((self.part.pos[:, 2] - RADIUS) / (self.height - RADIUS), 0.0, 1.0)
        return {
            "approach": 0.3 * nearness(self.to_part, 0.2),
            "lift": 0.7 * share,
            "achieved": np.where(self._is_achieved(), 0.5, 0.0),
        }
