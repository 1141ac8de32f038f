"""Expert that pushes a cube to a goal."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat, quat_conjugate, quat_rotate
from frobs_tasks_manipulation.experts.tool_expert import ToolExpert
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.rewards import length

BEHIND, DOWN, PUSH, AWAY = range(4)
_APART = 0.004  # [m] between the cube and the fingers beside it
_LEAD = 0.035  # [m] distance by which the command is ahead of the tool during a push
_HORIZONTAL = np.array([1.0, 1.0, 0.0])
_NEARER = 0.2  # [m] by which a push may be shorter, per meter by which its start is closer to the tool
_FARTHER = 0.015  # [m] by which a push aims beyond the goal, so that it ends at some speed
_FUNNEL = 0.008  # [m] by which the tool may be farther from the start of a push while it comes down
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
    """Expert that pushes the cube at the centers of its faces, because oblique pushes would rotate the cube.

    It has no memory: where the tool and the cube are decides what it does next, so that a policy can learn it from the
    state alone.
    """

    task: ObjectTask

    def bind(self, env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> None:
        """Compute the height at which the tool moves from one face to another."""
        super().bind(env)
        task = self.task
        self._height = task.size + min(0.05, 0.625 * task.grasp.clearance)
        self._face = np.zeros(task.num_envs, np.int64)  # push along the cube's x (0), y (1), −x (2) or −y (3) axis

    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        task, each = self.task, np.arange(self.task.num_envs)
        self._directions = axes = self._axes()
        tool = (self._fingers() - task.cube.pos) * _HORIZONTAL
        along = (axes * tool[:, None]).sum(axis=2)
        left = (axes * (task.goal - task.cube.pos)[:, None]).sum(axis=2)
        self._face = along.argmin(axis=1)  # the face that the tool is behind
        direction = axes[each, self._face]
        across = length(tool - along.min(axis=1)[:, None] * direction)
        apart = self._distance(direction) + along.min(axis=1)  # [m] by which the tool is closer than before a push
        low = np.where(apart > task.grasp.aligned, 0.9 * task.size, task.size / 2 + 0.01)
        pushing = (
            (task.tool.pos[:, 2] < low)
            & (across < 0.6 * task.size)
            & (left[each, self._face] > _ARRIVED * task.tolerance)
        )
        self._face = np.where(pushing, self._face, self._best_face(axes, left))
        aside = length((self._behind() - task.tool.pos) * _HORIZONTAL)
        direction = axes[each, self._face]
        free = self._distance(direction) - task.size / 2 - self._reach(direction) - _APART
        edge = free + _FUNNEL
        self._rise = np.clip((aside - task.grasp.aligned) / (edge - task.grasp.aligned), 0.0, 1.0)
        return np.select(
            [
                pushing,
                length((task.goal - task.cube.pos) * _HORIZONTAL) < _LEFT * task.tolerance,
                self._rise < 1.0,
                task.tool.pos[:, 2] > self._height - 0.02,
            ],
            [PUSH, AWAY, DOWN, BEHIND],
            AWAY,
        )

    def _axes(self) -> Floats:
        """Return the four directions in which the cube can be pushed, (num_envs, 4, 3)."""
        matrix = matrix_from_quat(self.task.cube.quat_wxyz)
        axes = np.stack([matrix[:, :, 0], matrix[:, :, 1], -matrix[:, :, 0], -matrix[:, :, 1]], axis=1)
        return np.asarray(axes * _HORIZONTAL)

    def _best_face(self, axes: Floats, left: Floats) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Return the index of the direction in which a push brings the cube closest to the goal, (num_envs,).

        A push that ends outside the working area is worth less, because the tool might not reach behind the cube there.
        Among directions that are about equally good, the direction whose start is closest to the tool is the best. This
        keeps the expert from alternating between directions.

        Args:
            axes: Directions, (num_envs, 4, 3).
            left: Distance from the cube to the goal in each direction, (num_envs, 4) [m].
        """
        task = self.task
        end = (task.cube.pos[:, None] + left[:, :, None] * axes)[:, :, :2]
        outside = np.maximum(np.abs(end - task.center) - task.area / 2, 0.0).max(axis=2)
        start = task.cube.pos[:, None] - task.size * axes - task.tool.pos[:, None]
        score = np.where(left > 2.0 * _ARRIVED * task.tolerance, left - outside, -1.0)
        return np.asarray((score - _NEARER * np.linalg.norm(start * _HORIZONTAL, axis=2)).argmax(axis=1))

    def _fingers(self) -> Floats:
        """Return the positions of the closed fingers, (num_envs, 3) [m]."""
        return self.task.tool.pos + self._offset()

    def _offset(self) -> Floats:
        """Return the vectors from the tool center point to the closed fingers, (num_envs, 3) [m]."""
        offset = np.array([[0.0, self.task.grasp.closed_at, 0.0]])
        return quat_rotate(self.task.tool.quat_wxyz, np.broadcast_to(offset, self.task.tool.pos.shape))

    def _distance(self, direction: Floats) -> Floats:
        """Return how far behind the cube the fingers come down, (num_envs,) [m], for directions (num_envs, 3)."""
        return push_distance(self.task.size, self.task.grasp.aligned, self._reach(direction))

    def _reach(self, direction: Floats) -> Floats:
        """Return how far the fingers extend from their center, (num_envs,) [m], in directions (num_envs, 3)."""
        local = quat_rotate(quat_conjugate(self.task.tool.quat_wxyz), direction)
        return np.asarray(np.abs(local[:, :2]) @ np.array(self.task.grasp.sides))

    def _way(self) -> tuple[Floats, Floats]:
        """Return the direction, (num_envs, 3), and the remaining distance, (num_envs,) [m], of the current push."""
        direction = self._directions[np.arange(len(self._face)), self._face]
        return direction, ((self.task.goal - self.task.cube.pos) * direction).sum(axis=1)

    def _behind(self) -> Floats:
        """Return the positions of the tool before a push, (num_envs, 3) [m]."""
        direction, _ = self._way()
        return np.asarray(self.task.cube.pos - self._distance(direction)[:, None] * direction - self._offset())

    def _aim(self) -> tuple[Floats, Floats]:
        task, phase = self.task, self.phase[:, None]
        direction, left = self._way()
        behind = self._behind()
        behind[:, 2] = task.size / 2 + self._rise * (self._height - task.size / 2)
        push = task.tool.pos + np.minimum(left + _FARTHER, _LEAD)[:, None] * direction
        push[:, 2] = task.size / 2
        away = task.tool.pos.copy()
        away[:, 2] = self._height
        return np.select([phase == PUSH, phase == AWAY], [push, away], behind), np.zeros(len(behind))
