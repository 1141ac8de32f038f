"""Reaching task for several arms at the same time."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Control, Simulation, StepContext, Task
from frobs_core.description import Camera, Marker, ObservationTerm, Scene
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_tasks_reach.reach import Reach


class ReachTogether(Task):
    """Task in which every controlled robot performs :class:`frobs_tasks_reach.reach.Reach` with its own goal.

    The observation and reward terms are the terms of ``Reach`` for each robot, with names of the form ``robot/term``.
    The reward is the sum over all robots. Each robot's goals are drawn from the robot's entire reach.

    Args:
        tolerance: Maximum distance between the tool and the goal at which the goal is considered reached [m].
        initial: Joint positions at reset: ``"home"``, or ``"random"`` for random positions within the limits.
        distance_weight: Penalty per meter of distance to the goal [1/m].
        precision_weight: Weight of the precision reward, which matters only within a few centimeters of the goal.

    Attributes:
        parts: Task of each robot, by robot name, set by ``bind``.

    Raises:
        ConfigurationError: A value is out of range.
    """

    reward_types: ClassVar[Sequence[str]] = Reach.reward_types
    reset_options: ClassVar[Sequence[str]] = ()
    control_timestep: ClassVar[float] = Reach.control_timestep
    physics_timestep: ClassVar[float] = Reach.physics_timestep
    success_rule: ClassVar[str] = (
        "the tools of all robots are within the tolerance of their goals when the time limit ends the episode"
    )
    instruction: ClassVar[str] = "Move the tool of each robot to its goal and hold it there."

    parts: Mapping[str, Reach]

    def __init__(
        self,
        *,
        tolerance: float = 0.05,
        initial: str = "home",
        distance_weight: float = 1.0,
        precision_weight: float = 0.5,
    ) -> None:
        self._keywords: dict[str, Any] = {
            "tolerance": tolerance,
            "initial": initial,
            "distance_weight": distance_weight,
            "precision_weight": precision_weight,
        }
        self._first = Reach(**self._keywords)  # raises an error if a value is invalid
        self.parts = {}
        self.reward_type = self.reward_types[0]

    def reset_needs(self, options: Collection[str] = ()) -> Mapping[str, Level]:
        """Return the capabilities required to reset all robots."""
        needs: dict[str, Level] = {}
        for part in (self._first, *self.parts.values()):
            needs |= part.reset_needs(options)
        return needs

    def scene(self) -> Scene:
        """Return a scene with a floor and a camera that sees two arms."""
        return Scene(cameras={"overview": Camera(pos=(2.2, -2.2, 1.8), target=(0.0, 0.0, 0.4), fov_y=50.0)})

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Create and bind a task for each controlled robot.

        Raises:
            ConfigurationError: A robot has no joints.
        """
        parts: dict[str, Reach] = {}
        for name in control.robots:
            parts[name] = part = Reach(**self._keywords)
            part.reward_type = self.reward_type
            part.robot_name = name
            part.bind(simulation, control, control_timestep)
        self.parts = parts

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Place every robot and its goal."""
        for part in self.parts.values():
            part.reset(mask, rng, {})

    def advance(self, context: StepContext) -> None:
        """Measure the tool positions."""
        for part in self.parts.values():
            part.advance(context)

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms of all robots."""
        return _named({name: part.observation_terms() for name, part in self.parts.items()})

    def reward(self, context: StepContext) -> Floats:
        """Return the sum of all robots' rewards, (num_envs,)."""
        total: Floats = np.sum([part.reward(context) for part in self.parts.values()], axis=0)
        return total

    def reward_terms(self) -> Mapping[str, Floats]:
        """Return the reward terms of all robots, (num_envs,) each."""
        return _named({name: part.reward_terms() for name, part in self.parts.items()})

    def is_success(self) -> Mask:
        """Return whether all tools in each environment are currently at their goals, (num_envs,) bool."""
        together: Mask = np.logical_and.reduce([part.is_success() for part in self.parts.values()])
        return together

    def markers(self) -> Sequence[Marker]:
        """Return markers for all goals and tools."""
        return [marker for part in self.parts.values() for marker in part.markers()]

    def stored_parts(self) -> Mapping[str, Task]:
        """Return the task of each robot."""
        return self.parts


def _named(parts: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    return {f"{name}/{key}": value for name, part in parts.items() for key, value in part.items()}
