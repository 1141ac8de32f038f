"""The command topics of one served robot, and the watchdog that makes the robot hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_ros2.errors import SettingsError
from frobs_ros2.ros import Node, optional_type
from frobs_ros2.serve.controller import ExternalCommands
from frobs_ros2.serve.trajectory import Trajectory

_INTEGRAL_GAIN = 5.0  # [1/s]
_LARGEST_OFFSET = 0.1  # [rad or m] largest correction by the integral term
_FARTHEST_HOLD = 0.02  # [rad or m] largest distance of a held position from the measured one


class ServedRobot:
    """Command topics of a robot: trajectories, forwarded commands, its gripper, and ``cmd_vel``.

    Trajectories are followed with an integral term, as by an arm's own controller, so that gravity does not displace
    the joints. Forwarded commands are sent to the drives unchanged.

    Args:
        handle: Handle of the robot.
        controllers: The controllers that command the robot's joints.
        node: Node of the server.
        namespace: Prefix of the robot's topics, empty or ``"name/"``.
        watchdog: Time without a forwarded command after which the robot holds [s], or 0 for no watchdog.

    Attributes:
        commands: Number of commands that were accepted, without those of the gripper.
        holding: Whether the watchdog has stopped the robot.
    """

    def __init__(
        self,
        handle: RobotHandle,
        controllers: list[ExternalCommands],
        node: Node,
        namespace: str,
        watchdog: float,
    ) -> None:
        self.handle, self.namespace, self.watchdog = handle, namespace, watchdog
        self._controllers, self._node = controllers, node
        drive, tool = handle.robot.differential_drive, handle.robot.end_effector_of()
        wheels = (*drive.left, *drive.right) if drive is not None else ()
        fingers = tuple(handle.robot.groups[tool.group]) if tool is not None and tool.group else ()
        self.arm = [i for i, name in enumerate(handle.joint_names) if name not in wheels and name not in fingers]
        self._fingers = [handle.joint_names.index(name) for name in fingers]
        self.arm_joints = [handle.joint_names[i] for i in self.arm]
        self.commands, self._gripper_commands, self.time, self.holding = 0, 0, 0.0, False
        self.reset()
        if self.arm:
            node.subscribe(
                "trajectory_msgs/msg/JointTrajectory",
                f"{namespace}joint_trajectory_controller/joint_trajectory",
                self.follow,
            )
            for mode in CommandMode:
                self._forward(f"{namespace}forward_{mode}_controller/commands", mode, self.arm)
        self._gripper_topic = f"{namespace}gripper_controller/commands"
        if self._fingers:
            self._forward(self._gripper_topic, CommandMode.POSITION, self._fingers)
        if drive is not None:
            node.subscribe("geometry_msgs/msg/Twist", f"{namespace}cmd_vel", self._drive)
        self._offer_actions()

    def reset(self) -> None:
        """Hold the current positions after a reset."""
        self._modes = [CommandMode.POSITION] * self.handle.dof
        self._targets = self.handle.joint_positions[0].copy()
        if self.handle.robot.differential_drive is not None:
            drive = self.handle.robot.differential_drive
            for name in (*drive.left, *drive.right):
                i = self.handle.joint_names.index(name)
                self._modes[i], self._targets[i] = CommandMode.VELOCITY, 0.0
        self._set_modes()
        self._trajectory: Trajectory | None = None
        self._offset = np.zeros(self.handle.dof)
        self._deadline, self.holding = np.inf, False
        self._gripper_commands = self.commands

    def follow(self, message: Any) -> None:
        """Begin a trajectory. A message without points stops the robot."""
        if not message.points:
            self.hold()
            return
        h = self.handle
        try:
            trajectory = Trajectory(
                message, self.arm_joints, h.joint_positions[0, self.arm], h.position_lower[0, self.arm],
                h.position_upper[0, self.arm],
            )  # fmt: skip
        except SettingsError as error:
            self._node.log(str(error))
            return
        self._use_mode(self.arm, CommandMode.POSITION)
        self._trajectory, self._began, self._deadline = trajectory, self.time, np.inf
        self._accept()

    def set_command(self, mode: CommandMode, columns: list[int], values: Any) -> None:
        """Forward a command to some of the joints, or log why it is rejected.

        Args:
            mode: Meaning of the values.
            columns: Columns of the joints.
            values: One value per joint.
        """
        command = np.array(values, float)
        if command.shape != (len(columns),) or not np.isfinite(command).all():
            self._node.log(
                f"a {mode} command was rejected: it has {command.size} values ({command}), and must have "
                f"{len(columns)} finite ones."
            )
            return
        self._use_mode(columns, mode)
        h = self.handle
        if mode is CommandMode.POSITION:
            lower, upper = h.position_lower[0, columns], h.position_upper[0, columns]
        else:
            upper = (h.velocity_limit if mode is CommandMode.VELOCITY else h.effort_limit)[0, columns]
            lower = -upper
        self._targets[columns] = np.clip(command, lower, upper)
        if columns == self.arm:
            self._trajectory = None
            self._offset[:] = 0.0
        if columns == self._fingers:  # a gripper keeps its last command, which does not replace a trajectory
            self._gripper_commands += 1
            return
        self._deadline = self.time + self.watchdog if self.watchdog else np.inf
        self._accept()

    def hold(self) -> None:
        """Stop at the current positions."""
        h = self.handle
        moving = [i for i in range(h.dof) if i not in self._fingers]
        fixed = [i for i in moving if self._modes[i] is not CommandMode.VELOCITY or i in self.arm]
        measured, limit = h.joint_positions[0], _FARTHEST_HOLD
        targets = np.where(
            [mode is CommandMode.POSITION for mode in self._modes],
            np.clip(self._targets, measured - limit, measured + limit),
            measured,
        )
        self._use_mode(fixed, CommandMode.POSITION)
        self._targets[moving] = 0.0
        self._targets[fixed] = targets[fixed]
        self._trajectory, self._deadline = None, np.inf

    def write_rows(self, decimation: int, timestep: float, time: float) -> None:
        """Give the drives the commands of the next step.

        Args:
            decimation: Number of physics steps.
            timestep: Duration of a physics step [s].
            time: Time of the server at the start of the step [s].
        """
        self.time = time
        if time > self._deadline:
            self.holding = True
            self.hold()
            self._node.log(f"holding: no command for {self.watchdog:g} s")
        rows = self._targets[None]
        if self._trajectory is not None:
            columns = np.array(self.arm)[self._trajectory.columns]
            error = self._trajectory.sample(time - self._began) - self.handle.joint_positions[0, columns]
            offset = self._offset[columns] + _INTEGRAL_GAIN * decimation * timestep * error
            self._offset[columns] = np.clip(offset, -_LARGEST_OFFSET, _LARGEST_OFFSET)
            rows = np.repeat(rows, decimation, axis=0)
            for i in range(decimation):
                rows[i, columns] = self._trajectory.sample(time + (i + 1) * timestep - self._began)
            self._targets[columns] = rows[-1, columns]
            rows = rows + self._offset * (np.array(self._modes) == CommandMode.POSITION)
        else:
            rows = rows + self._offset
        for controller in self._controllers:
            columns = np.array([self.handle.joint_names.index(name) for name in controller.joints.joint_names], int)
            part = rows[:, columns]
            controller.rows = part if len(part) == 1 else part[None]

    def count_steps(self) -> int:
        """Return the number of steps for which all commands have arrived: also those of a gripper if a node sends any."""
        if not self._fingers or not self._node.node.count_publishers(self._gripper_topic):
            self._gripper_commands = self.commands
        return min(self.commands, self._gripper_commands)

    @property
    def is_done(self) -> bool:
        """Whether the last point of the trajectory has been reached in time."""
        return self._trajectory is None or self.time - self._began >= self._trajectory.duration

    def _forward(self, topic: str, mode: CommandMode, columns: list[int]) -> None:
        self._node.subscribe(
            "std_msgs/msg/Float64MultiArray", topic, lambda message: self.set_command(mode, columns, message.data)
        )

    def _drive(self, message: Any) -> None:
        drive, names = self.handle.robot.differential_drive, self.handle.joint_names
        assert drive is not None
        v = float(np.clip(message.linear.x, -drive.max_linear_velocity, drive.max_linear_velocity))
        w = float(np.clip(message.angular.z, -drive.max_angular_velocity, drive.max_angular_velocity))
        sides = dict.fromkeys(drive.left, v - 0.5 * w * drive.separation)
        sides |= dict.fromkeys(drive.right, v + 0.5 * w * drive.separation)
        columns = [names.index(name) for name in sides]
        self.set_command(CommandMode.VELOCITY, columns, [value / drive.wheel_radius for value in sides.values()])

    def _use_mode(self, columns: list[int], mode: CommandMode) -> None:
        if all(self._modes[i] is mode for i in columns):
            return
        for i in columns:
            self._modes[i] = mode
        self._targets[columns] = self.handle.joint_positions[0, columns] if mode is CommandMode.POSITION else 0.0
        self._offset[columns] = 0.0
        self._set_modes()

    def _set_modes(self) -> None:
        if tuple(self._modes) != self.handle.command_modes:
            self.handle.set_command_mode(self._modes)

    def _accept(self) -> None:
        self.commands += 1
        self.holding = False

    def _offer_actions(self) -> None:
        """Offer the actions of ros2_control if their types are installed."""
        report: Callable[[str], None] = self._node.log
        if not self.arm:
            return
        kind = optional_type("control_msgs/action/FollowJointTrajectory", report)
        if kind is None:
            return
        from frobs_ros2.serve.actions import offer_follow, offer_gripper

        offer_follow(self, self._node, kind)
        if self._fingers:
            gripper = optional_type("control_msgs/action/GripperCommand", report)
            if gripper is not None:
                offer_gripper(self, self._node, gripper, self._fingers)
