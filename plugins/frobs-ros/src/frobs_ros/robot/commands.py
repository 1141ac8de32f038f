"""Publishes the commands of a robot to its ROS controller."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import MissingSettingError
from frobs_ros.errors import ControllerError, RosError
from frobs_ros.messages.types import find_type
from frobs_ros.ros.master import connect
from frobs_ros.ros.names import resolve
from frobs_ros.ros.processes import wait_for
from frobs_ros.ros.services import call, is_offered

_PATIENCE = 5.0
"""Maximum time for sending the last command [s]."""

_MODES = {"position": CommandMode.POSITION, "velocity": CommandMode.VELOCITY, "effort": CommandMode.EFFORT}


class Commands:
    """Commands to the controller of a robot. The process must already be a ROS node.

    Args:
        robot: The robot.
        namespace: ROS namespace of the robot.
        controller: Controller that receives the commands, or None to control a wheeled robot through ``cmd_vel``.
        cmd_vel: Topic of the velocity commands for a wheeled robot without a named controller.

    Raises:
        ConfigurationError: The controller is unknown, is not running, or does not accept the robot's commands.
        RosError: No master responds, or a call to the controller manager fails.
    """

    def __init__(self, robot: RobotHandle, namespace: str, controller: str | None, cmd_vel: str) -> None:
        import rospy

        self._robot, self._namespace = robot, namespace
        self._order = list(robot.joint_names)
        self._publisher, self._message = self._open(controller, cmd_vel)
        self._holds = threading.Event()
        self._holds.set()
        rospy.on_shutdown(self._wait_until_it_holds)

    def _name(self, topic: str) -> str:
        return resolve(self._namespace, topic)

    def _advertise(self, topic: str, kind: str) -> Any:
        import rospy

        return rospy.Publisher(self._name(topic), find_type(kind), queue_size=1)

    def _open(self, controller: str | None, cmd_vel: str) -> tuple[Any, Callable[[Floats, float], Any]]:
        """Return the publisher for commands, and a function that converts a command to a message."""
        import rospy

        mode = self._robot.command_mode
        drive = self._robot.robot.differential_drive
        if controller is None:
            if drive is None:
                raise MissingSettingError(
                    "the policy", "a controller for its commands", f"use --controller {self._controllers()}"
                )
            return self._advertise(cmd_vel, "geometry_msgs/Twist"), self._twist
        given = rospy.get_param(self._name(f"{controller}/type"), None)
        if given is None:
            raise ControllerError(
                controller,
                f"the controller is not loaded in the namespace {self._namespace or '/'}; "
                f"loaded controllers: {self._controllers()}",
            )
        self._check_running(controller)
        if "DiffDrive" in given and drive is not None:
            return self._advertise(f"{controller}/cmd_vel", "geometry_msgs/Twist"), self._twist
        takes = _MODES.get(given.partition("_")[0])
        if takes is not mode:
            raise ControllerError(
                controller,
                f"the type {given} does not accept the policy's {mode.value} commands; choose a controller that "
                "accepts them.",
            )
        self._order = list(rospy.get_param(self._name(f"{controller}/joints"), self._order))
        if sorted(self._order) != sorted(self._robot.joint_names):
            raise ControllerError(
                controller,
                f"the controller moves the joints {', '.join(self._order)}, but the policy moves the joints "
                f"{', '.join(self._robot.joint_names)}.",
            )
        if "JointTrajectory" in given:
            return self._advertise(f"{controller}/command", "trajectory_msgs/JointTrajectory"), self._trajectory
        if "JointGroup" in given:
            return self._advertise(f"{controller}/command", "std_msgs/Float64MultiArray"), self._group
        raise ControllerError(
            controller,
            f"the type {given} moves a single joint; choose a JointTrajectoryController or a JointGroup… controller.",
        )

    def _check_running(self, controller: str) -> None:
        """Check that a controller is running, unless no controller manager is available."""
        from controller_manager_msgs.srv import ListControllers

        service = self._name("controller_manager/list_controllers")
        if not is_offered(service):
            return
        states = {each.name: each.state for each in call(service, ListControllers).controller}
        if states.get(controller) != "running":
            running = ", ".join(sorted(name for name, state in states.items() if state == "running"))
            raise ControllerError(
                controller,
                f"the controller is {states.get(controller, 'not loaded')}; running controllers: {running or '(none)'}"
                ". Start the controller with ros_controllers.start_controllers_srv or the switch_controller service.",
            )

    def _controllers(self) -> str:
        import rosgraph

        try:  # ask the master directly, because rospy returns cached values
            params = connect().getParam(self._namespace or "/")
        except rosgraph.MasterError:
            params = {}
        names = [
            n for n, value in params.items() if isinstance(value, Mapping) and "Controller" in str(value.get("type"))
        ]
        return ", ".join(sorted(names)) or "(none is loaded)"

    def send(self, values: Floats, seconds: float) -> None:
        """Publish a command.

        Args:
            values: Command of each joint, (dof,), in the unit of the robot's command mode.
            seconds: Duration of the command's step [s].
        """
        self._holds.clear()
        self._publisher.publish(self._message(values, seconds))

    def hold(self, seconds: float) -> None:
        """Publish the command to hold the measured position until it has been sent to every subscriber.

        rospy sends messages from another thread, and discards unsent messages when the node shuts down.

        Args:
            seconds: Duration of a step [s].

        Raises:
            RosError: The command was not sent within five seconds.
        """
        before = self._sent()
        values = self._robot.holding_command(self._robot.joint_positions[0])

        def is_sent() -> bool:
            self.send(values, seconds)
            sent = self._sent()  # the first may be an earlier command that was still being sent
            return all(sent[number] >= count + 2 for number, count in before.items() if number in sent)

        try:
            if not wait_for(is_sent, _PATIENCE, 0.001):
                raise RosError(
                    "the command to hold the position could not be sent; the robot may still be moving. Stop the robot "
                    "by other means, and check that the nodes that receive its commands respond."
                )
        finally:
            self._holds.set()

    @property
    def is_holding(self) -> bool:
        """Whether the last command was to hold the position, or no command has been sent."""
        return self._holds.is_set()

    def close(self) -> None:
        """End the connections to the controller."""
        self._publisher.unregister()

    def _wait_until_it_holds(self) -> None:
        """Delay the shutdown of the node until the robot has been commanded to hold its position."""
        self._holds.wait(2.0 * _PATIENCE)

    def _sent(self) -> dict[int, int]:
        """Return the number of commands that were sent on each open connection."""
        _, _, connections = self._publisher.impl.get_stats()
        return {number: count for number, _, count, is_open in connections if is_open}

    def _ordered(self, command: Floats) -> list[float]:
        values = dict(zip(self._robot.joint_names, command.tolist(), strict=True))
        return [values[name] for name in self._order]

    def _trajectory(self, command: Floats, seconds: float) -> Any:
        import rospy
        from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

        point = JointTrajectoryPoint(time_from_start=rospy.Duration.from_sec(seconds))
        mode = self._robot.command_mode
        field = {CommandMode.POSITION: "positions", CommandMode.VELOCITY: "velocities"}.get(mode, "effort")
        setattr(point, field, self._ordered(command))
        return JointTrajectory(joint_names=self._order, points=[point])

    def _group(self, command: Floats, seconds: float) -> Any:
        from std_msgs.msg import Float64MultiArray

        return Float64MultiArray(data=self._ordered(command))

    def _twist(self, command: Floats, seconds: float) -> Any:
        from geometry_msgs.msg import Twist

        drive = self._robot.robot.differential_drive
        assert drive is not None
        turns = dict(zip(self._robot.joint_names, command.tolist(), strict=True))
        left, right = (
            drive.wheel_radius * sum(turns[name] for name in side) / len(side) for side in (drive.left, drive.right)
        )
        message = Twist()
        message.linear.x, message.angular.z = (left + right) / 2.0, (right - left) / drive.separation
        return message
