"""Expert that pushes a cube to a goal."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.rotations import matrix_from_quat
from frobs_tasks_manipulation.cube_task import CubeTask
from frobs_tasks_manipulation.experts.tool_expert import ToolExpert
from frobs_tasks_manipulation.rewards import length

BEHIND, DOWN, PUSH, AWAY = range(4)
_HEIGHT = 0.09  # [m] height of the tool while it moves to another side of the cube
_GAP = 0.03  # [m] distance between the cube and the tool before a push
_ALIGNED = 0.008  # [m] maximum position error at which the tool is considered aligned
_LEAD = 0.035  # [m] distance by which the command is ahead of the tool during a push
_ARRIVED, _LEFT = 0.2, 0.7  # errors, in multiples of the tolerance, at which a push ends and at which a new push begins


class PushCube(ToolExpert[Any]):
    """Expert that pushes the cube at the centers of its faces, because oblique pushes would rotate the cube."""

    task: CubeTask

    def bind(self, env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> None:
        """Allocate the expert's memory."""
        super().bind(env)
        self._face = np.zeros(self.task.num_envs, np.int64)  # push along the cube's x (0), y (1), −x (2) or −y (3) axis

    def _begin(self, mask: Mask) -> None:
        self._face[mask] = self._best_face()[mask]

    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        task, phase = self.task, self.phase
        direction, left = self._way()
        tool = (task.tcp - task.cube.pos) * [1.0, 1.0, 0.0]
        across = length(tool - (tool * direction).sum(axis=1)[:, None] * direction)
        aside = length((self._aim()[0] - task.tcp) * [1.0, 1.0, 0.0])
        distance = length((task.goal - task.cube.pos) * [1.0, 1.0, 0.0])
        again = (phase == AWAY) & (distance > _LEFT * task.tolerance) & (task.tcp[:, 2] > task.size + 0.03)
        self._face = np.where(again, self._best_face(), self._face)
        return np.select(
            [
                again,
                (phase == BEHIND) & (aside < _ALIGNED),
                (phase == DOWN) & (task.tcp[:, 2] < task.size / 2 + 0.005),
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
        """Return the index of the direction in which a push brings the cube closest to the goal, (num_envs,)."""
        way = self.task.goal - self.task.cube.pos
        return np.asarray((self._axes() * way[:, None]).sum(axis=2).argmax(axis=1))

    def _way(self) -> tuple[Floats, Floats]:
        """Return the direction, (num_envs, 3), and the remaining distance, (num_envs,) [m], of the current push."""
        direction = self._axes()[np.arange(len(self._face)), self._face]
        return direction, ((self.task.goal - self.task.cube.pos) * direction).sum(axis=1)

    def _aim(self) -> tuple[Floats, Floats]:
        task = self.task
        cube, phase = task.cube.pos, self.phase[:, None]
        direction, left = self._way()
        behind = cube - (task.size / 2 + _GAP) * direction
        behind[:, 2] = np.where(self.phase == BEHIND, _HEIGHT, task.size / 2)
        push = task.tcp + np.minimum(left, _LEAD)[:, None] * direction
        push[:, 2] = task.size / 2
        away = task.tcp.copy()
        away[:, 2] = _HEIGHT
        return np.select([phase == PUSH, phase == AWAY], [push, away], behind), np.zeros(len(cube))
