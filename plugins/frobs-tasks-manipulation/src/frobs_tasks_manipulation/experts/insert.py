"""Expert for the peg insertion task."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.arrays import Floats, Mask
from frobs_tasks_manipulation.experts.grasp import ABOVE, CARRY, CLOSE, GraspCube
from frobs_tasks_manipulation.peg_insertion import HEIGHT, PegInsertion
from frobs_tasks_manipulation.rewards import length
from frobs_tasks_manipulation.working_area import UP

LOWER = CARRY + 1
_ABOVE = 0.003  # [m] height of the peg's lower end above the block before the peg is lowered
_WAY = 0.025  # [m] height of the peg's lower end above the block during transfer
_RISE = 0.015  # [m] if the peg is farther than this below the transfer height, it is first raised straight up
_STEP = 0.02  # [m] maximum commanded motion per step; fast motion tilts the peg between the fingers
_SLOWLY = 0.006  # [m] maximum commanded downward motion per step
_GENTLY = 0.003  # [m] commanded downward motion per step until the peg has entered the hole
_ENTERED = 0.004  # [m] depth of the lower end at which the peg is considered to have entered the hole
_GAIN, _LARGEST = 0.12, 0.008  # integral gain per control step, and limit on the integrated error [m]
_FIRM, _STOPPED = 6, 0.004  # lift the peg after _FIRM control steps in which the opening changes by less than _STOPPED


class InsertPeg(GraspCube[Any]):
    """Expert that carries the peg above the hole, aligns the peg's lower end with the hole, and lowers the peg.

    The expert integrates the horizontal error of the peg's lower end, because the tool lags behind its commands and the
    peg tilts slightly between the fingers.
    """

    task: PegInsertion

    def bind(self, env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> None:
        """Allocate the expert's memory."""
        super().bind(env)
        self._correction = np.zeros((self.task.num_envs, 3))  # [m]
        self._closing = np.zeros((self.task.num_envs, 3))  # [m] position of the peg when the fingers began to close
        self._still = np.zeros(self.task.num_envs, np.int64)  # number of control steps since the fingers last moved

    def _begin(self, mask: Mask) -> None:
        self._correction[mask] = 0.0

    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        task, phase = self.task, self.phase
        error = self._error()
        aside = length(error[:, :2])
        outside = task.end[:, 2] > HEIGHT - 0.002
        near = ((phase == CARRY) & (aside < 0.01)) | (phase == LOWER)
        integrated = np.clip(self._correction + _GAIN * error, -_LARGEST, _LARGEST) * [1.0, 1.0, 0.0]
        self._correction = np.where(near[:, None], integrated, 0.0)
        self._still = np.where(self.finger_speed < _STOPPED, self._still + 1, 0)
        self._closing = np.where((phase == CLOSE)[:, None], self._closing, task.grip)
        aligned = (aside < max(0.3 * task.clearance, 0.0003)) & (task.speed < 0.02) & (np.abs(error[:, 2]) < 0.002)
        return np.select(
            [
                (phase == CLOSE) & (task.to_cube < 0.03) & (self._still < _FIRM),
                (phase == CARRY) & aligned,
                (phase == LOWER) & (task.to_cube > 0.03),
                (phase == LOWER) & outside & (aside > 2.0 * task.clearance + 0.002),
            ],
            [CLOSE, LOWER, ABOVE, CARRY],
            super()._next_phase(),
        )

    def _error(self) -> Floats:
        """Return the remaining motion of the peg's lower end, (num_envs, 3) [m].

        If the peg has entered the hole, the remaining motion of its center is returned instead.
        """
        task = self.task
        center = task.goal - task.cube.pos
        above = np.where(length(center[:, :2]) < 0.01, _ABOVE, _WAY)[:, None]
        inside = (task.end[:, 2] < HEIGHT - _ENTERED) & (length(center[:, :2]) < 0.01)
        floor = task.goal - task.height / 2 * UP
        return np.where(inside[:, None], center, floor + (HEIGHT + above) * UP - task.end)

    def _aim(self) -> tuple[Floats, Floats]:
        place, opening = super()._aim()
        tcp, error = self.task.tool.pos, self._error()
        rising = (error[:, 2] > _RISE) & (length(error[:, :2]) > _RISE)
        carried = np.where(rising[:, None], error * UP, error + self._correction)
        carried = carried * np.minimum(1.0, _STEP / np.maximum(length(carried), 1e-9))[:, None]
        lowered = error + self._correction
        outside = self.task.end[:, 2] > HEIGHT - 0.002
        down = np.maximum(self.task.goal[:, 2] - self.task.cube.pos[:, 2], -_SLOWLY)
        waiting = outside & (length(error[:, :2]) > 0.4 * self.task.clearance + 0.0004)
        entering = self.task.end[:, 2] > HEIGHT - _ENTERED
        lowered[:, 2] = np.where(waiting, error[:, 2], np.where(entering, -_GENTLY, down))
        phase = self.phase[:, None]
        places = [self._closing, tcp + carried, tcp + lowered]
        return np.select([phase == CLOSE, phase == CARRY, phase == LOWER], places, place), opening
