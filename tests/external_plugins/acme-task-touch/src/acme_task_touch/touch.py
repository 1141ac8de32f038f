"""The task."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import ConfigurationError
from frobs_core.interfaces import Controller, Simulation, Snapshot, StepContext, Task
from frobs_core.observation import ObservationTerm
from frobs_core.random import RandomSource


class Touch(Task):
    """Bring the tool to a point, which ends the episode. The point is where the tool is at drawn joint positions.

    Args:
        tolerance: Distance that touches [m].

    Raises:
        ConfigurationError: The tolerance is not positive.
    """

    reset_options: ClassVar[tuple[str, ...]] = ("goal",)

    def __init__(self, *, tolerance: float = 0.05) -> None:
        if tolerance <= 0:
            raise ConfigurationError(f"touch: tolerance is {tolerance}; it must be positive.")
        self.tolerance = tolerance
        self.reward_type = self.reward_types[0]

    def bind(self, simulation: Simulation, controller: Controller, control_timestep: float) -> None:
        """Prepare for a simulation."""
        self._robot = robot = simulation.robots["robot"]
        self._goal, self._tool = np.zeros((2, robot.num_envs, 3))
        self._distance: Floats = np.zeros(robot.num_envs)

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Draw a point."""
        rows = slice(None) if mask is None else mask
        low, high = self._robot.position_lower[0], self._robot.position_upper[0]
        drawn = rng.uniform("goal", low, high, (self._robot.dof,), mask)
        given = options.get("goal")
        self._goal[rows] = self._robot.frame_pose("tcp", drawn)[0] if given is None else given[rows]
        self.advance(rng)

    def advance(self, context: StepContext) -> None:
        """Measure where the tool is."""
        self._tool = self._robot.frame_pose("tcp")[0].copy()
        x, y, z = np.moveaxis(self._goal - self._tool, -1, 0)
        self._distance = np.sqrt(x * x + y * y + z * z)

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return joints, how fast they turn, and where the point is: 2 · dof + 3 numbers."""
        robot = self._robot
        return {
            "joint_positions": _within_ten(robot.dof, "rad", lambda: robot.joint_positions),
            "joint_velocities": _within_ten(robot.dof, "rad/s", lambda: robot.joint_velocities),
            "way": _within_ten(2, "m", lambda: (self._goal - self._tool)[:, :2]),
            "distance": _within_ten(1, "m", lambda: self._distance[:, None]),
        }

    def reward(self, context: StepContext) -> Floats:
        """Return −distance, and 1 more where it touches; (num_envs,)."""
        return -self._distance + self.is_success()

    def reward_terms(self) -> Mapping[str, Floats]:
        """Return both parts."""
        return {"distance": -self._distance, "touch": self.is_success().astype(np.float64)}

    def is_terminated(self) -> Mask:
        """Return where it touches."""
        return self.is_success()

    def is_success(self) -> Mask:
        """Return where it touches."""
        return self._distance <= self.tolerance

    def snapshot(self) -> Snapshot:
        """Return the point, and what was measured."""
        return {"goal": self._goal.copy(), "tool": self._tool.copy(), "distance": self._distance.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._goal, self._tool = snapshot["goal"].copy(), snapshot["tool"].copy()
        self._distance = snapshot["distance"].copy()


def _within_ten(width: int, unit: str, read: Callable[[], Floats]) -> ObservationTerm:
    far = np.full(width, 10.0)
    return ObservationTerm(read=lambda: np.clip(read(), -far, far), low=-far, high=far, unit=unit)
