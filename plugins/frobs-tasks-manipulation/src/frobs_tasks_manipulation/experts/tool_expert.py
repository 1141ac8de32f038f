"""Base class of the experts, which work in phases that each have a target position and a gripper opening."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, Generic, TypeVar, cast

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Controller, Expert
from frobs_core.description import Observation
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError
from frobs_tasks_manipulation.manipulation import Manipulation

_GAIN = 0.4
"""Fraction of the remaining distance that the tool is commanded to move in a control step."""

_LAG = 0.06
"""Lag of the tool behind its commands [s], which the expert anticipates in order to brake in time."""

TaskT = TypeVar("TaskT", bound=Manipulation)


class ToolExpert(Expert, Generic[TaskT]):
    """Base class of experts that move an arm's tool to target positions and open and close the gripper.

    The arm requires a controller that moves the tool along the world's axes, such as ``tcp_delta_pose``. The gripper
    can use any gripper controller.

    Attributes:
        task: Task of the environment.
        phase: Number of the current phase, (num_envs,) int, 0 at the start of an episode.
        age: Number of control steps spent in the current phase, (num_envs,) int.
        finger_speed: Absolute change in the gripper's opening in the last control step, (num_envs,).
    """

    def bind(self, env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> None:
        """Find the controllers of the arm and the gripper.

        Raises:
            ConfigurationError: The environment has several robots, or the arm's controller does not move the tool.
        """
        bare = cast("RobotEnv | RobotVectorEnv", env.unwrapped)  # because its task names this expert
        self.task: TaskT = bare.task  # type: ignore[assignment] # only tasks of this type name this expert
        self._control_timestep = bare.control_timestep
        robot, tool = bare.robot, self.task.tool.gripper
        arm = tool.arm or next(iter(robot.robot.groups))
        controllers = bare.control.controllers
        if len(bare.control.robots) != 1:
            raise ConfigurationError("the expert can only move one robot, but this environment has several robots.")
        self._arm, self._gripper = controllers.get(f"{robot.name}/{arm}"), controllers.get(f"{robot.name}/{tool.group}")
        if tuple(getattr(self._arm, "axes", ())[:3]) != ("x", "y", "z"):
            raise ConfigurationError(
                "the expert requires a controller that moves the tool along the world axes; choose 'tcp_delta_pose' "
                "for the arm."
            )
        self._columns, self._width = _columns(controllers)
        self._arm_columns = self._columns[f"{robot.name}/{arm}"][:3]
        self._gripper_columns = self._columns.get(f"{robot.name}/{tool.group}", [])
        num_envs = self.task.num_envs
        self.phase, self.age = np.zeros(num_envs, np.int64), np.zeros(num_envs, np.int64)
        self.finger_speed = np.zeros(num_envs)
        self._opening = np.zeros(num_envs)

    def act(self, observation: Observation, episode_start: Mask) -> Floats:
        """Return actions for the current state, (num_envs, action size)."""
        if episode_start.any():
            self.phase[episode_start] = self.age[episode_start] = 0
            self._begin(episode_start)
        self.finger_speed = np.abs(self.task.tool.opening - self._opening)
        self._opening = self.task.tool.opening.copy()
        phase = self._next_phase()
        self.age = np.where(phase == self.phase, self.age + 1, 0)
        self.phase = phase
        place, opening = self._aim()
        action = np.zeros((len(phase), self._width))
        soon = self.task.tool.pos + _LAG * self.task.tool.velocity
        step = _GAIN * (place - soon) / self._arm.max_delta  # type: ignore[union-attr] # checked above

        # All axes are scaled by the same factor, so that the tool moves in a straight line.
        largest = np.maximum(np.abs(step).max(axis=1, keepdims=True), 1.0)
        action[:, self._arm_columns] = step / largest
        if self._gripper is not None:
            action[:, self._gripper_columns] = self._gripper_action(opening)[:, None]
        return action

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return ``phase``, the number of each environment's current phase, (num_envs,) int."""
        return {"phase": self.phase.copy()}

    def _moving_at(self, velocity: Floats) -> Floats:
        """Return target positions (num_envs, 3) [m] that make the tool move at given velocities (num_envs, 3) [m/s]."""
        soon = self.task.tool.pos + _LAG * self.task.tool.velocity
        return soon + self._control_timestep / _GAIN * velocity

    def _gripper_action(self, opening: Floats) -> Floats:
        max_delta = getattr(self._gripper, "max_delta", None)
        if max_delta is None:  # the action specifies the opening, or only its sign matters
            return 2.0 * opening - 1.0
        # A gripper that holds an object is commanded to close further, so that it keeps squeezing.
        requested = np.where(opening <= 0.0, -1.0, opening)
        return np.asarray(np.clip((requested - self.task.tool.opening) / max_delta, -1.0, 1.0))

    # -- Methods that experts define --

    def _begin(self, mask: Mask) -> None:
        """Discard the state from previous episodes in the environments selected by the mask."""

    @abstractmethod
    def _next_phase(self) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Determine each environment's phase from the current state, (num_envs,)."""

    @abstractmethod
    def _aim(self) -> tuple[Floats, Floats]:
        """Return the tool's target position, (num_envs, 3) [m], and the gripper opening, (num_envs,) in [0, 1]."""


def _columns(controllers: dict[str, Controller]) -> tuple[dict[str, list[int]], int]:
    """Return the action columns that belong to each controller, and the size of the action."""
    columns: dict[str, list[int]] = {}
    start = 0
    for name, controller in controllers.items():
        width = (controller.action_space.shape or (1,))[0]
        columns[name] = list(range(start, start + width))
        start += width
    return columns, start
