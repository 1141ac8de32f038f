"""Gripper controllers that open and close all fingers with a single action component."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller, JointGroup, Snapshot
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.errors import ParameterValueError, UnsuitableRobotError
from frobs_core.util.validation import positive


class Gripper(Controller):
    """Base class of controllers that move fingers between an end effector's closed and open positions.

    The opening ranges from 0 (closed) to 1 (open). No finger moves faster than its velocity limit. A gripper that
    closes around an object keeps squeezing the object with the effort of the finger drives.
    """

    command_mode = CommandMode.POSITION
    owner: ClassVar[str] = ""
    """Name of the controller."""

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints.

        Raises:
            UnsuitableRobotError: No end effector of the robot has exactly these joints, or a joint's open or closed
                position is missing, or both are equal.
        """
        robot, tool = joints.robot, joints.end_effector
        if tool is None or tool.group != joints.group_name:
            raise UnsuitableRobotError(
                robot.name,
                f"has no gripper with the joints {', '.join(joints.joint_names)}; add an EndEffector with "
                "this joint group and its open and closed positions to the Robot.",
            )
        for joint in joints.joint_names:
            if joint not in tool.open or joint not in tool.closed:
                raise UnsuitableRobotError(
                    robot.name, f"must define both an open and a closed position for the finger '{joint}'."
                )
            if tool.open[joint] == tool.closed[joint]:
                raise UnsuitableRobotError(
                    robot.name, f"must define different open and closed positions for the finger '{joint}'."
                )
        self._joints = joints
        self._closed = np.array([tool.closed[joint] for joint in joints.joint_names])  # (dof,) [rad or m]
        self._stroke = np.array([tool.open[joint] for joint in joints.joint_names]) - self._closed
        self._control_timestep = control_timestep
        # maximum change in the opening per control step
        self._fastest = joints.velocity_limit * control_timestep / np.abs(self._stroke)
        self._slowest = -self._fastest
        self._wanted, self._opening = np.zeros((joints.num_envs, 1)), np.zeros((joints.num_envs, joints.dof))
        self.action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.reset(None)

    def reset(self, mask: Mask | None) -> None:
        """Set the requested and commanded openings to the current opening."""
        opening = (self._joints.joint_positions - self._closed) / self._stroke
        self._opening[rows_of(mask)] = opening[rows_of(mask)]
        self._wanted[rows_of(mask)] = np.clip(opening.mean(axis=1, keepdims=True), 0.0, 1.0)[rows_of(mask)]

    def apply(self, action: Action) -> Floats:
        """Return the target joint positions, (num_envs, dof) [rad or m]."""
        # np.minimum and np.maximum together take less than half the time of np.clip.
        requested = self._want(np.minimum(np.maximum(action, -1.0), 1.0))
        np.minimum(np.maximum(requested, 0.0), 1.0, out=self._wanted)
        change = np.minimum(np.maximum(self._wanted - self._opening, self._slowest), self._fastest)
        np.add(self._opening, change, out=self._opening)
        return np.asarray(self._closed + self._opening * self._stroke)

    def law(self) -> Mapping[str, Any]:
        """Return the numbers of the law: joint position = closed + opening · stroke.

        ``max_change`` is the largest change of each finger's opening per control step, and ``max_delta`` the change of
        the requested opening for an action of 1, or None if the action sets the opening.
        """
        return {
            "law": self.owner,
            "joints": list(self._joints.joint_names),
            "closed": self._closed.tolist(),
            "stroke": self._stroke.tolist(),
            "max_change": self._fastest[0].tolist(),
            "max_delta": getattr(self, "max_delta", None),
        }

    @abstractmethod
    def _want(self, action: Floats) -> Floats:
        """Return the requested opening (num_envs, 1) for an action in [−1, 1]."""

    def stored_arrays(self) -> Snapshot:
        """Return the requested and commanded openings."""
        return {"wanted": self._wanted, "opening": self._opening}


class GripperPosition(Gripper):
    """Gripper controller whose action sets the opening: −1 closes the gripper, and 1 opens it fully."""

    owner = "gripper_position"

    def _want(self, action: Floats) -> Floats:
        return 0.5 * (action + 1.0)


class GripperDelta(Gripper):
    """Gripper controller whose action changes the commanded opening by up to one step. An action of 0 keeps it.

    Args:
        max_delta: Change in the opening for an action of 1, as a fraction of the full stroke, in (0, 1].
    """

    owner = "gripper_delta"

    def __init__(self, *, max_delta: float = 0.2) -> None:
        self.max_delta = positive("gripper_delta: max_delta", max_delta, "1")
        if self.max_delta > 1.0:
            raise ParameterValueError("max_delta", max_delta, "in (0, 1]", "gripper_delta")

    def _want(self, action: Floats) -> Floats:
        return self._wanted + self.max_delta * action


class GripperBinary(Gripper):
    """Gripper controller that opens for positive actions, closes for negative actions, and keeps its state for 0.

    Random actions constantly open and close the gripper, so the robot drops every object during exploration. The
    controller ``gripper_delta`` is therefore better suited to learning.
    """

    owner = "gripper_binary"

    def _want(self, action: Floats) -> Floats:
        return np.where(action == 0.0, self._wanted, action > 0.0)
