"""Expert that opens a piece of furniture by its handle."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_tasks_manipulation.experts.tool_expert import ToolExpert
from frobs_tasks_manipulation.open_task import OpenTask
from frobs_tasks_manipulation.rewards import length
from frobs_tasks_manipulation.working_area import UP

ABOVE, DOWN, CLOSE, PULL, RELEASE = range(5)
_CLEARANCE = 0.1  # [m] height above the handle from which the tool moves down
_ALIGNED = 0.01  # [m] maximum position error at which the tool is considered aligned
_LOST = 0.05  # [m] distance between tool and handle above which the handle is considered lost
_CLOSING = 8  # minimum number of control steps for closing the gripper
_STOPPED = 0.005  # change in the opening per control step below which the fingers are assumed to touch the handle
_OPENING = 6  # control steps for opening the gripper before the tool moves up
_ARRIVED, _LEFT = 0.3, 0.8  # errors, in multiples of the tolerance, at which to release the handle and to grip it again
_STEP = 0.03  # [m] distance by which the command is ahead of the handle along its path


class PullHandle(ToolExpert[Any]):
    """Expert that grips the handle from above and pulls it along its path until the joint is at its target.

    The expert then opens the gripper and moves up, because fingers around the handle can shake it.
    """

    task: OpenTask

    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        task, phase = self.task, self.phase
        aside = length((task.handle - task.tool.pos)[:, :2])
        left = np.abs(task.target - task.joint)
        slow = np.abs(task.joint_speed) < 0.5 * task.max_speed
        return np.select(
            [
                (phase == PULL) & (left < _ARRIVED * task.tolerance) & slow,
                (phase == RELEASE) & (left > _LEFT * task.tolerance) & slow,
                (phase == ABOVE) & (aside < _ALIGNED),
                (phase == DOWN) & (aside > 3 * _ALIGNED),
                (phase == DOWN) & (task.to_handle < _ALIGNED),
                (phase == CLOSE) & (self.age >= _CLOSING) & (self.finger_speed < _STOPPED),
                ((phase == CLOSE) | (phase == PULL)) & (task.to_handle > _LOST),
            ],
            [RELEASE, DOWN, DOWN, ABOVE, CLOSE, PULL, ABOVE],
            phase,
        )

    def _aim(self) -> tuple[Floats, Floats]:
        task, phase = self.task, self.phase[:, None]
        way = task.handle_at(task.target) - task.handle
        share = np.minimum(1.0, _STEP / np.maximum(length(way), 1e-9))
        ahead = task.handle_at(task.joint + share * (task.target - task.joint)) - task.handle
        pulled = task.tool.pos + ahead
        pulled[:, 2] = task.handle[:, 2]
        above = (phase == ABOVE) | ((phase == RELEASE) & (self.age[:, None] >= _OPENING))
        place = np.select([above, phase == PULL], [task.handle + _CLEARANCE * UP, pulled], task.handle)
        return place, np.where((self.phase <= DOWN) | (self.phase == RELEASE), 1.0, 0.0)
