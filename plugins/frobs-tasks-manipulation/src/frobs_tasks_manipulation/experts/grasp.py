"""Experts that grasp and carry a cube."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_tasks_manipulation.experts.tool_expert import TaskT, ToolExpert
from frobs_tasks_manipulation.lift import Lift
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.rewards import length
from frobs_tasks_manipulation.working_area import UP

ABOVE, DOWN, CLOSE, CARRY, RELEASE, RETREAT = range(6)
_OPENING = 8  # minimum number of control steps for closing or opening the gripper
_STOPPED = 0.005  # change in the opening per control step below which the fingers are assumed to touch an object


class GraspCube(ToolExpert[TaskT]):
    """Expert that moves above an object, moves down, closes the gripper, and carries the object to its target."""

    task: ObjectTask  # type: ignore[assignment]

    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        task, phase = self.task, self.phase
        aside = length((task.grip - task.tool.pos)[:, :2])
        return np.select(
            [
                (phase == ABOVE) & (aside < task.grasp.aligned),
                (phase == DOWN) & (aside > 3 * task.grasp.aligned),
                (phase == DOWN) & (task.to_cube < task.grasp.aligned),
                (phase == CLOSE) & (self.age >= _OPENING) & (self.finger_speed < _STOPPED),
                ((phase == CLOSE) | (phase == CARRY)) & (task.to_cube > task.grasp.lost),
            ],
            [DOWN, ABOVE, CLOSE, CARRY, ABOVE],
            phase,
        )

    def _aim(self) -> tuple[Floats, Floats]:
        grip, phase = self.task.grip, self.phase[:, None]
        carried = self._carry_to() - self.task.cube.pos + self.task.tool.pos
        place = np.select([phase == ABOVE, phase == CARRY], [grip + self.task.grasp.clearance * UP, carried], grip)
        return place, np.where(self.phase <= DOWN, 1.0, 0.0)

    def _carry_to(self) -> Floats:
        """Return the target for the object's center, (num_envs, 3) [m]."""
        return self.task.goal + self._detour(0.04)[:, None] * UP

    def _detour(self, height: float) -> Floats:
        """Return the height above the target at which to carry the object, (num_envs,) [m]."""
        aside = length((self.task.goal - self.task.cube.pos)[:, :2])
        return np.where(aside > 0.01, np.minimum(height, aside), 0.0)


class CarryCube(GraspCube[Any]):
    """Expert that carries the cube to the goal."""


class LiftCube(GraspCube[Any]):
    """Expert that lifts the cube straight up."""

    task: Lift

    def _carry_to(self) -> Floats:
        place = self.task.cube.pos.copy()
        place[:, 2] = self.task.rest_height + self.task.lowest + 0.05
        return place


class StackCube(GraspCube[Any]):
    """Expert that places the cube on the other cube, opens the gripper, and moves up."""

    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        task, phase = self.task, self.phase
        placed = (task.to_goal < 0.6 * task.tolerance) & (task.speed < 0.03)
        return np.select(
            [
                (phase == CARRY) & placed,
                (phase == RELEASE) & (task.tool.opening > 0.8),
                (phase == RETREAT) & (task.to_goal > task.tolerance) & (self.age > _OPENING),
            ],
            [RELEASE, RETREAT, ABOVE],
            super()._next_phase(),
        )

    def _carry_to(self) -> Floats:
        aside = length((self.task.goal - self.task.cube.pos)[:, :2])
        # Stay high enough to clear the other cube until the carried cube is directly above its target.
        return self.task.goal + np.where(aside > 0.006, 0.04, 0.0)[:, None] * UP

    def _aim(self) -> tuple[Floats, Floats]:
        place, opening = super()._aim()
        phase, grip = self.phase[:, None], self.task.grip
        place = np.select([phase == RELEASE, phase == RETREAT], [self.task.tool.pos, grip + 0.12 * UP], place)
        return place, np.where(self.phase >= RELEASE, 1.0, opening)
