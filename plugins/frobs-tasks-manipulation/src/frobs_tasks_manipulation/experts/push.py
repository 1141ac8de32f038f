"""Expert that pushes a cube to a goal."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.rotations import matrix_from_quat, quat_conjugate, quat_rotate
from frobs_tasks_manipulation.experts.tool_expert import ToolExpert
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.rewards import length

BEHIND, DOWN, PUSH, AWAY = range(4)
_APART = 0.004  # [m] between the cube and the fingers beside it
_LEAD = 0.035  # [m] distance by which the command is ahead of the tool during a push
_ARRIVED, _LEFT = 0.2, 0.7  # errors, in multiples of the tolerance, at which a push ends and at which a new push begins


def push_distance(size: float, aligned: float, fingers: Floats | float = 0.0) -> Floats:
    """Return the distance between the center of a cube and the fingers before a push [m]. They must not land on the cube.

    Args:
        size: Edge of the cube [m].
        aligned: Maximum position error of the tool [m].
        fingers: How far the fingers extend toward the cube [m].
    """
    room = min(0.03, max(0.75 * size, 0.02 + aligned))
    return size / 2 + np.maximum(room, fingers + aligned + _APART)


class PushCube(ToolExpert[Any]):
    """Expert that pushes the cube at the centers of its faces, because oblique pushes would rotate the cube."""

    task: ObjectTask

    def bind(self, env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> None:
        """Allocate the expert's memory."""
        super().bind(env)
        task = self.task
        self._height = task.size + min(0.05, 0.625 * task.grasp.clearance)  # while the tool moves to another face
        self._face = np.zeros(task.num_envs, np.int64)  # push along the cube's x (0), y (1), −x (2) or −y (3) axis

    def _begin(self, mask: Mask) -> None:
        self._face[mask] = self._best_face()[mask]

    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        task, phase = self.task, self.phase
        direction, left = self._way()
        tool = (self._fingers() - task.cube.pos) * [1.0, 1.0, 0.0]
        across = length(tool - (tool * direction).sum(axis=1)[:, None] * direction)
        aside = length((self._aim()[0] - task.tool.pos) * [1.0, 1.0, 0.0])
        distance = length((task.goal - task.cube.pos) * [1.0, 1.0, 0.0])
        again = (phase == AWAY) & (distance > _LEFT * task.tolerance) & (task.tool.pos[:, 2] > self._height - 0.02)
        self._face = np.where(again, self._best_face(), self._face)
        return np.select(
            [
                again,
                (phase == BEHIND) & (aside < task.grasp.aligned),
                (phase == DOWN) & (task.tool.pos[:, 2] < task.size / 2 + 0.005),
                (phase == PUSH) & ((left < _ARRIVED * task.tolerance) | (across > 0.6 * task.size)),
            ],
            [BEHIND, DOWN, PUSH, AWAY],
            phase,
        )

    def _axes(self) -> Floats:
        """Return the four directions in which the cube can be pushed, (num_envs, 4, 3)."""
        matrix = matrix_from_quat(self.task.cube.quat_wxyz)
        axes = np.stack([matrix[:, :, 0], matrix[:, :, 1], -matrix[:, :, 0], -matrix[:, :, 1]], axis=1)
        return axes * [1.0, 1.0, 0.0]

    def _best_face(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Return the index of the direction in which a push brings the cube closest to the goal, (num_envs,).

        A push that ends outside the working area is worth less, because the tool might not reach behind the cube there.
        """
        task, axes = self.task, self._axes()
        left = (axes * (task.goal - task.cube.pos)[:, None]).sum(axis=2)
        end = (task.cube.pos[:, None] + left[:, :, None] * axes)[:, :, :2]
        outside = np.maximum(np.abs(end - task.center) - task.area / 2, 0.0).max(axis=2)
        return np.asarray((left - outside).argmax(axis=1))

    def _fingers(self) -> Floats:
        """Return the positions of the closed fingers, (num_envs, 3) [m]."""
        return self.task.tool.pos + self._offset()

    def _offset(self) -> Floats:
        """Return the vectors from the tool center point to the closed fingers, (num_envs, 3) [m]."""
        offset = np.array([[0.0, self.task.grasp.closed_at, 0.0]])
        return quat_rotate(self.task.tool.quat_wxyz, np.broadcast_to(offset, self.task.tool.pos.shape))

    def _distance(self, direction: Floats) -> Floats:
        """Return how far behind the cube the fingers come down, (num_envs,) [m], for directions (num_envs, 3)."""
        grasp, quat = self.task.grasp, self.task.tool.quat_wxyz
        fingers = np.abs(quat_rotate(quat_conjugate(quat), direction)[:, :2]) @ np.array(grasp.sides)
        return push_distance(self.task.size, grasp.aligned, fingers)

    def _way(self) -> tuple[Floats, Floats]:
        """Return the direction, (num_envs, 3), and the remaining distance, (num_envs,) [m], of the current push."""
        direction = self._axes()[np.arange(len(self._face)), self._face]
        return direction, ((self.task.goal - self.task.cube.pos) * direction).sum(axis=1)

    def _aim(self) -> tuple[Floats, Floats]:
        task = self.task
        cube, phase = task.cube.pos, self.phase[:, None]
        direction, left = self._way()
        behind = cube - self._distance(direction)[:, None] * direction - self._offset()
        behind[:, 2] = np.where(self.phase == BEHIND, self._height, task.size / 2)
        push = task.tool.pos + np.minimum(left, _LEAD)[:, None] * direction
        push[:, 2] = task.size / 2
        away = task.tool.pos.copy()
        away[:, 2] = self._height
        return np.select([phase == PUSH, phase == AWAY], [push, away], behind), np.zeros(len(cube))
