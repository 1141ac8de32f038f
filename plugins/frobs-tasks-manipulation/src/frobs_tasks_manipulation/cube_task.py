"""Base class of tasks with one cube and a goal for the cube."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Snapshot
from frobs_core.description import Body, Marker, ObservationTerm, Scene
from frobs_core.models import Box, Pose
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import positive
from frobs_tasks_manipulation.manipulation import FLOOR_FRICTION, Manipulation
from frobs_tasks_manipulation.observed import bounded
from frobs_tasks_manipulation.rewards import length
from frobs_tasks_manipulation.tracked import Tracked

CUBE = "cube"
BLUE = (0.16, 0.42, 0.82, 1.0)
_NEAR = 0.03
"""Maximum absolute value of the terms for small offsets [m]."""


class CubeTask(Manipulation):
    """Base class of tasks in which one cube must be brought to a goal.

    Args:
        size: Edge length of the cube [m].
        mass: Mass of the cube [kg].
        friction: Sliding friction coefficient of the cube.
        tolerance: Maximum distance between the cube's center and the goal at which the goal is considered reached [m].
        max_speed: Maximum speed at which the cube is considered to be at rest [m/s].
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_manipulation.manipulation.Manipulation`.

    Attributes:
        body_name: Name of the object in the scene, the observation and the reset options.
        shows_goal: Whether the observation and rendered images contain the goal.
        goal_clearance: Minimum horizontal distance between the cube and the goal at the start of an episode, in
            multiples of the tolerance.

    Raises:
        ConfigurationError: A value is out of range.
    """

    reset_options: ClassVar[Sequence[str]] = ("cube_position", "goal")
    late_terms: ClassVar[Sequence[str]] = ("cube_offset_near", "goal_offset_near")
    shows_goal: ClassVar[bool] = True
    body_name: ClassVar[str] = CUBE
    goal_clearance: ClassVar[float] = 2.5

    def __init__(
        self,
        *,
        size: float = 0.04,
        mass: float = 0.1,
        friction: float = 0.5,
        tolerance: float = 0.05,
        max_speed: float = 0.1,
        **keywords: Any,
    ) -> None:
        super().__init__(**keywords)
        self.size = positive("size", size, "m")
        self.mass = positive("mass", mass, "kg")
        self.friction = positive("friction", friction)
        self.tolerance = positive("tolerance", tolerance, "m")
        self.max_speed = positive("max_speed", max_speed, "m/s")

    def scene(self) -> Scene:
        """Return a scene with a cube on the floor."""
        x, y = self.center.tolist()
        cube = Body(
            geometry=Box((self.size,) * 3),
            pose=Pose((x, y, self.size / 2)),
            mass=self.mass,
            friction=self.friction,
            rgba=BLUE,
        )
        return Scene(
            floor_friction=FLOOR_FRICTION, hard_contacts=True, bodies={self.body_name: cube}, cameras=self.cameras()
        )

    def _bind_objects(self) -> None:
        self.cube = Tracked(self._simulation.bodies[self.body_name])
        self.goal = np.zeros((self.num_envs, 3))

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for the tool, cube and goal, and for the offsets cube − tool and goal − cube."""
        terms = {
            **self.tool_terms(),
            **self.cube.terms(self.body_name),
            f"{self.body_name}_offset": bounded(lambda: self.grip - self.tcp, 3, 2.0, "m", scale=5.0),
        }
        if self.shows_goal:
            terms["goal"] = bounded(lambda: self.goal, 3, 2.0, "m", scale=4.0)
            terms["goal_offset"] = bounded(lambda: self.goal - self.cube.pos, 3, 2.0, "m", scale=5.0)
        return terms

    def near_terms(self) -> dict[str, ObservationTerm]:
        """Return the observation terms for the offsets cube − tool and goal − cube, clipped to 3 cm along each axis.

        Learners scale each observation by its typical size. Without these terms, they hardly distinguish offsets of a
        few millimeters.
        """
        return {
            f"{self.body_name}_offset_near": bounded(lambda: self.grip - self.tcp, 3, _NEAR, "m", scale=1.0 / _NEAR),
            "goal_offset_near": bounded(lambda: self.goal - self.cube.pos, 3, _NEAR, "m", scale=1.0 / _NEAR),
        }

    @property
    def rest_height(self) -> float:
        """Height of the cube's center when the cube is on the floor [m]."""
        return self.size / 2

    @property
    def grip(self) -> Floats:
        """Position at which the tool grips the cube, (num_envs, 3) [m]."""
        return self.cube.pos

    def markers(self) -> Sequence[Marker]:
        """Return a marker at the goal, with the tolerance as its radius."""
        return (Marker(self.goal, self.tolerance),) if self.shows_goal else ()

    def stored_arrays(self) -> Snapshot:
        """Return the goal and the number of steps for which the success condition has been met."""
        return {**super().stored_arrays(), "goal": self.goal}

    def _measure(self) -> None:
        super()._measure()
        self.cube.read()
        self.to_cube = length(self.grip - self.tcp)  # (num_envs,) [m]
        self.to_goal = length(self.goal - self.cube.pos)  # (num_envs,) [m]
        self.speed = length(self.cube.velocity)  # (num_envs,) [m/s]

    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        cube = self.draw_place("cube", rng, mask, height=self.rest_height)
        if (option := f"{self.body_name}_position") in options:
            cube = self.checked_place(option, options[option], self.rest_height)
        self.cube.body.write_pose(cube, self.draw_turn("cube_turn", rng, mask), mask)
        goal = self._draw_goal(cube, mask, rng)
        self.goal[rows_of(mask)] = (
            self.checked_place("goal", options["goal"], self.rest_height) if "goal" in options else goal
        )

    def _is_achieved(self) -> Mask:
        return np.asarray((self.to_goal <= self.tolerance) & (self.speed <= self.max_speed))

    def draw_floor_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Floats:
        """Draw a goal on the floor, away from the cube's initial position.

        Args:
            cube: Initial positions of the cubes, (n, 3) [m].
            mask: The n environments for which to draw.
            rng: Source of the random numbers.

        Returns:
            The goals in the world frame, (n, 3) [m].
        """
        apart = self.goal_clearance * self.tolerance
        return self.draw_place("goal", rng, mask, height=self.size / 2, apart_from=cube, distance=apart)

    @abstractmethod
    def _draw_goal(self, cube: Floats, mask: Mask | None, rng: RandomSource) -> Any:
        """Draw goals, (n, 3) [m], for the selected environments, given the initial positions ``cube``, (n, 3) [m]."""
