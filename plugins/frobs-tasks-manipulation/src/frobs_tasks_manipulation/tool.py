"""Tool of an arm with a gripper: its start posture, and its state, which is read once per step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from frobs_core.contracts import Controller, RobotHandle
from frobs_core.description import EndEffector, ObservationTerm
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import UnsuitableRobotError
from frobs_core.util.rotations import quat_from_axis_angle, quat_multiply
from frobs_core.util.validation import boolean, check_fields, finite, non_negative, number_list, positive
from frobs_tasks_manipulation.reachable import Workspace, start_posture
from frobs_tasks_manipulation.tracked import bounded
from frobs_tasks_manipulation.working_area import UP


@dataclass(frozen=True, kw_only=True)
class Grasp:
    """How the tool approaches an object. The defaults are those of an arm of the size of a Panda.

    Attributes:
        yaw: Rotation of the tool about the vertical axis at the start of an episode, and of the objects [rad].
        radial: Whether tool and objects also turn with their direction from the origin, because the arm has four axes
            and cannot turn the tool by itself.
        clearance: Height above an object from which the tool moves down to it [m].
        aligned: Maximum position error at which the tool is considered aligned with an object [m].
        lost: Distance between the tool and a gripped object above which the object is considered lost [m].
        turn: Largest rotation of an object on the floor about the vertical axis, in both directions [rad].
        gap: Smallest and largest width between the fingers [m].
        depth: Distance by which the fingers extend beyond the tool center point [m].
        room: Distance from the tool center point back to the palm [m].
        width: Width of the fingers across the direction in which they close [m].
        closed_at: Position of the closed fingers along the tool's y axis [m]. It is not 0 if one of the jaws is fixed.
        sides: How far the closed fingers extend from their middle along the tool's x and y axes [m].
    """

    yaw: float = 0.0
    radial: bool = False
    clearance: float = 0.08
    aligned: float = 0.008
    lost: float = 0.03
    turn: float = np.pi / 12  # the fingers still fit around a cube
    gap: tuple[float, float] = (0.0, 0.08)
    depth: float = 0.009
    room: float = 0.045
    width: float = 0.024
    closed_at: float = 0.0
    sides: tuple[float, float] = (0.012, 0.012)

    @classmethod
    def read(cls, settings: Mapping[str, Any] | None) -> Grasp:
        """Return the grasp that a mapping of attributes describes.

        Raises:
            ConfigurationError: An attribute is unknown or out of range.
        """
        settings = settings or {}
        check_fields("grasp", cls, settings)
        gap = number_list("grasp.gap", settings.get("gap", cls.gap), 2)
        sides = number_list("grasp.sides", settings.get("sides", cls.sides), 2)
        grasp = replace(cls(**settings), gap=(gap[0], gap[1]), sides=(sides[0], sides[1]))
        finite("grasp.yaw", grasp.yaw, "rad")
        finite("grasp.closed_at", grasp.closed_at, "m")
        boolean("grasp.radial", grasp.radial)
        for name in ("clearance", "aligned", "lost", "depth", "room", "width"):
            positive(f"grasp.{name}", getattr(grasp, name), "m")
        non_negative("grasp.turn", grasp.turn, "rad")
        return grasp

    def turned(self, quat_wxyz: Floats, pos: Floats) -> Floats:
        """Return orientations (n, 4) after the rotation about the vertical axis that applies at positions (n, 3) [m]."""
        if not self.yaw and not self.radial:
            return quat_wxyz
        azimuth = np.arctan2(pos[:, 1], pos[:, 0]) if self.radial else np.zeros(len(pos))
        return quat_multiply(quat_from_axis_angle(UP, azimuth + self.yaw), quat_wxyz)


class Tool:
    """Tool of an arm with a gripper. The arrays are updated in place.

    Args:
        robot: Handle of the arm.
        controllers: Controllers of all joint groups, by ``"robot/group"``.
        opening: Opening of the gripper at the start of an episode.
        workspace: Where the tool works.

    Attributes:
        gripper: Description of the gripper.
        pos: Position of the tool center point in the world frame, (num_envs, 3) [m].
        quat_wxyz: Orientation of the tool in the world frame, (num_envs, 4).
        velocity: Linear velocity of the tool center point in the world frame, (num_envs, 3) [m/s].
        opening: Opening of the gripper, from 0 (closed) to 1 (open), (num_envs,).

    Raises:
        UnsuitableRobotError: The robot has no gripper, or its tool cannot work there.
    """

    gripper: EndEffector

    def __init__(
        self, robot: RobotHandle, controllers: Mapping[str, Controller], opening: float, workspace: Workspace
    ) -> None:
        gripper = robot.end_effector
        if gripper is None or not gripper.is_gripper:
            raise UnsuitableRobotError(
                robot.robot.name, "has no gripper; attach one with Robot.attach, or choose a robot such as 'panda'."
            )
        self._robot, self.gripper = robot, gripper
        self._fingers = [robot.joint_names.index(joint) for joint in gripper.closed]
        self._closed = np.array([*gripper.closed.values()])
        self._stroke = np.array([gripper.open[joint] for joint in gripper.closed]) - self._closed
        arm = controllers.get(f"{robot.name}/{gripper.arm or next(iter(robot.robot.groups))}")
        self._start = start_posture(robot, gripper, arm, workspace)
        self._start[self._fingers] = self._closed + opening * self._stroke
        self.pos, self.velocity = np.zeros((2, robot.num_envs, 3))
        self.quat_wxyz = np.zeros((robot.num_envs, 4))
        self.opening = np.zeros(robot.num_envs)

    def place(self, mask: Mask | None) -> None:
        """Move the arm to its start posture in the environments selected by the mask."""
        count = self._robot.num_envs if mask is None else int(mask.sum())
        self._robot.write_joint_state(np.tile(self._start, (count, 1)), mask=mask)

    def read(self) -> None:
        """Read the current state of the tool."""
        self.pos[:], self.quat_wxyz = self._robot.frame_pose("tcp")
        self.velocity[:] = self._robot.frame_velocity("tcp")[0]
        shares = (self._robot.joint_positions[:, self._fingers] - self._closed) / self._stroke
        self.opening[:] = shares.sum(axis=1) / len(self._fingers)

    def read_effort(self) -> Floats:
        """Return the fingers' mean drive effort as a fraction of its limit, < 0 if it closes them, (num_envs, 1)."""
        shares = self._robot.joint_efforts[:, self._fingers] / self._robot.effort_limit[:, self._fingers]
        return np.asarray((shares * np.sign(self._stroke)).sum(axis=1, keepdims=True) / len(self._fingers))

    def terms(self) -> dict[str, ObservationTerm]:
        """Return the observation terms for the tool: position [m], linear velocity [m/s] and gripper opening."""
        return {
            "tcp_position": bounded(self.pos, 2.0, "m", scale=4.0, proprioceptive=True),
            "tcp_velocity": bounded(self.velocity, 5.0, "m/s", proprioceptive=True),
            "gripper_opening": bounded(self.opening[:, None], 1.5, "1", proprioceptive=True),
        }
