"""Expert that slides a puck to a goal."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.arrays import Floats, Mask
from frobs_tasks_manipulation.experts.tool_expert import ToolExpert
from frobs_tasks_manipulation.rewards import length
from frobs_tasks_manipulation.slide import GRAVITY, Slide

BEHIND, DOWN, PUSH, AWAY = range(4)
_HEIGHT = 0.06  # [m] height of the tool while it moves to another position behind the puck
_LOW = 0.022  # [m] height of the tool while it pushes
_GAP = 0.025  # [m] distance between the tool's center and the puck before a push
_OPENING = 0.5  # gripper opening at which both fingertips touch the puck, so that it cannot roll off sideways
_TOUCH = 0.1  # [m/s] speed of the tool when it touches the puck
_TOUCHING = 6  # number of control steps after which both fingertips touch the puck
_ACCELERATION = 1.5  # [m/s²] maximum acceleration of the tool in a push
_FASTER = 0.25  # fraction of the missing speed that is added per control step
_AIMED = 0.02  # [m] distance between the goal and the predicted end of the slide at which the tool releases the puck
_LONGEST = 40  # maximum number of control steps in a push
_BRAKING, _BACK = 3, 0.1  # number of steps in which the tool brakes after a push, and commanded backward distance [m]
_RISE = 5.0  # [1/s] vertical speed of the tool per unit of height error
_STILL = 0.02  # [m/s] speed below which the puck is considered to be at rest
_FORWARD = np.array([1.0, 0.0, 0.0])
_HORIZONTAL = np.array([1.0, 1.0, 0.0])


class SlidePuck(ToolExpert[Any]):
    """Expert that pushes the puck with both fingertips until the puck is fast enough to slide to the goal.

    The gripper must be half open, which requires the controller ``gripper_delta`` or ``gripper_position``. The arm
    requires the controller ``tcp_delta_pose`` with ``interpolate=True``. Without interpolation, the tool's speed
    oscillates, and the puck separates from the tool too early.
    """

    task: Slide

    def bind(self, env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> None:
        """Allocate the expert's memory."""
        super().bind(env)
        self._velocity = np.zeros((self.task.num_envs, 3))  # [m/s] velocity of the tool during a push
        self._asked = np.zeros(self.task.num_envs)  # commanded opening

    def _begin(self, mask: Mask) -> None:
        self._asked[mask] = self.task.tool.opening[mask]

    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        task, phase = self.task, self.phase
        direction, left = self._way()
        # distance from the place where the puck will come to rest to the goal [m]
        missing = (task.rest_offset * direction[:, :2]).sum(axis=1)
        aside = length((self._behind() - task.tool.pos) * _HORIZONTAL)
        again = (task.speed < _STILL) & (left > task.tolerance) & ~task.is_gone & (self.age > _BRAKING)
        return np.select(
            [
                (phase == BEHIND) & (aside < task.grasp.aligned),
                (phase == DOWN) & (task.tool.pos[:, 2] < _LOW + 0.005) & (task.tool.opening > 0.9 * _OPENING),
                (phase == PUSH) & ((missing < _AIMED) | (self.age > _LONGEST)),
                (phase == AWAY) & again,
            ],
            [DOWN, PUSH, AWAY, BEHIND],
            phase,
        )

    def _way(self) -> tuple[Floats, Floats]:
        """Return the direction from the puck to the goal, (num_envs, 3), and the distance, (num_envs,) [m]."""
        way = (self.task.goal - self.task.cube.pos) * _HORIZONTAL
        left = length(way)
        return way / np.maximum(left, 1e-9)[:, None], left

    def _behind(self) -> Floats:
        """Return the tool position at which a push begins, (num_envs, 3) [m]."""
        place = self.task.cube.pos - (self.task.size / 2 + _GAP) * _FORWARD
        place[:, 2] = np.where(self.phase == BEHIND, _HEIGHT, _LOW)
        return place

    def _aim(self) -> tuple[Floats, Floats]:
        task, phase = self.task, self.phase[:, None]
        away = task.tool.pos - np.where(self.age < _BRAKING, _BACK, 0.0)[:, None] * _FORWARD
        away[:, 2] = _HEIGHT
        place = np.select([phase == PUSH, phase == AWAY], [self._moving_at(self._push()), away], self._behind())
        return place, np.full(len(place), _OPENING)

    def _push(self) -> Floats:
        """Return the velocity of the tool during a push, (num_envs, 3) [m/s]."""
        task = self.task
        direction, left = self._way()
        needed = np.sqrt(2.0 * task.friction * GRAVITY * left)[:, None] * direction
        # The puck follows the tool, which lags behind its command.
        soon = 0.5 * (task.cube.velocity * _HORIZONTAL + self._velocity)
        change, most = _FASTER * (needed - soon), _ACCELERATION * self._control_timestep
        change = change * (most / np.maximum(length(change), most))[:, None]
        touching = (self.age > _TOUCHING)[:, None]
        self._velocity = np.where(touching, self._velocity + change, _TOUCH * _FORWARD)
        velocity = self._velocity.copy()
        velocity[:, 2] = _RISE * (_LOW - task.tool.pos[:, 2])
        return velocity

    def _gripper_action(self, opening: Floats) -> Floats:
        max_delta = getattr(self._gripper, "max_delta", None)
        if max_delta is None:
            return super()._gripper_action(opening)
        # Use the sum of the actions instead of the current opening, because the fingers lag behind their command.
        change = np.clip(opening - self._asked, -max_delta, max_delta)
        self._asked = self._asked + change
        return np.asarray(change / max_delta)
