"""Subscribes to a robot's measurements on ROS topics, and publishes commands for the robot."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, MissingSettingError
from frobs_ros.bridge.poses import read_pose, read_twist, read_vector
from frobs_ros.errors import ControllerError, RosError
from frobs_ros.messages.types import find_type
from frobs_ros.policy_node.mirror import Command, Mirror, State
from frobs_ros.policy_node.scans import rays_of
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import connect
from frobs_ros.ros.names import resolve
from frobs_ros.ros.processes import wait_for
from frobs_ros.ros.services import call, is_offered

_PATIENCE = 5.0
"""Maximum time for sending the last command [s]."""

_MODES = {"position": CommandMode.POSITION, "velocity": CommandMode.VELOCITY, "effort": CommandMode.EFFORT}


@dataclass(frozen=True)
class Topics:
    """Topics of a robot. Relative names are resolved in the robot's namespace.

    Attributes:
        joint_states: Topic of the joint states (sensor_msgs/JointState). Several nodes may publish on this topic.
        odom: Topic of the odometry of a moving base (nav_msgs/Odometry).
        scan: Topic of the lidar's scans (sensor_msgs/LaserScan).
        goal: Topic of new goals in the world frame [m] (geometry_msgs/Point).
        cmd_vel: Topic of the velocity commands for a wheeled robot without a named controller (geometry_msgs/Twist).
    """

    joint_states: str = "joint_states"
    odom: str = "odom"
    scan: str = "scan"
    goal: str = "goal_pos"
    cmd_vel: str = "cmd_vel"


class RosRobot:
    """A robot that is controlled through ROS topics. The process must already be a ROS node.

    Args:
        mirror: Mirror of the robot.
        namespace: ROS namespace of the robot.
        controller: Controller that receives the commands. By default, a wheeled robot is controlled through its
            ``cmd_vel`` topic.
        topics: Topics of the robot.

    Attributes:
        odom_frame: Frame of the most recent odometry message.

    Raises:
        ConfigurationError: The controller is unknown, is not running, or does not accept the policy's commands, or the
            policy uses several lidars.
        RosError: No master responds, or a call to the controller manager fails.
    """

    def __init__(
        self, mirror: Mirror, namespace: str = "/", controller: str | None = None, topics: Topics | None = None
    ) -> None:
        use_ros()
        import rospy

        self._mirror, self._namespace = mirror, namespace.rstrip("/")
        topics = topics or Topics()
        if len(mirror.lidars) > 1:
            raise ConfigurationError(
                f"the policy uses the lidars {', '.join(mirror.lidars)}, but only one lidar is supported."
            )
        self._lock = threading.Lock()
        self._began = time.monotonic()
        self._joints: dict[str, tuple[float, float]] = {}
        self._base: tuple[Floats, Floats, Floats, Floats] | None = None
        self._scan: Any = None
        self._goal: Floats | None = None
        self.odom_frame = "odom"
        measured = {"joint states": (topics.joint_states, "sensor_msgs/JointState", self._hear_joints)}
        if mirror.moves:
            measured["odometry"] = topics.odom, "nav_msgs/Odometry", self._hear_odometry
        if mirror.lidars:
            measured["scan"] = topics.scan, "sensor_msgs/LaserScan", self._hear_scan
        self._heard = dict.fromkeys(measured, -math.inf)
        for topic, kind, hear in (*measured.values(), (topics.goal, "geometry_msgs/Point", self._hear_goal)):
            rospy.Subscriber(self._name(topic), find_type(kind), hear, queue_size=1, tcp_nodelay=True)
        self._publisher, self._message = self._open(controller, topics)
        self._ending, self._holds = threading.Event(), threading.Event()
        self._holds.set()
        rospy.on_shutdown(self._end)

    def _name(self, topic: str) -> str:
        return resolve(self._namespace, topic)

    def _advertise(self, topic: str, kind: str) -> Any:
        import rospy

        return rospy.Publisher(self._name(topic), find_type(kind), queue_size=1)

    def _open(self, controller: str | None, topics: Topics) -> tuple[Any, Any]:
        """Return the publisher for commands, and a function that converts a command to a message."""
        import rospy

        mode = self._mirror.env.robot.command_mode
        drive = self._mirror.env.robot.robot.differential_drive
        if controller is None:
            if drive is None:
                raise MissingSettingError(
                    "the policy", "a controller for its commands", f"use --controller {self._controllers()}"
                )
            return self._advertise(topics.cmd_vel, "geometry_msgs/Twist"), self._twist
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
        self._order = list(rospy.get_param(self._name(f"{controller}/joints"), list(self._mirror.joint_names)))
        if sorted(self._order) != sorted(self._mirror.joint_names):
            raise ControllerError(
                controller,
                f"the controller moves the joints {', '.join(self._order)}, but the policy moves the joints "
                f"{', '.join(self._mirror.joint_names)}.",
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

    def _hear_joints(self, message: Any) -> None:
        velocities = message.velocity or [0.0] * len(message.name)
        with self._lock:
            self._joints.update(zip(message.name, zip(message.position, velocities, strict=True), strict=True))
            if all(name in self._joints for name in self._mirror.joint_names):
                self._heard["joint states"] = time.monotonic()

    def _hear_odometry(self, message: Any) -> None:
        place = read_pose(message.pose.pose)
        motion = read_twist(message.twist.twist).turned(place.quat_wxyz)  # it is expressed in the frame of the base
        with self._lock:
            self.odom_frame = message.header.frame_id
            self._base = (*place, *motion)
            self._heard["odometry"] = time.monotonic()

    def _hear_scan(self, message: Any) -> None:
        with self._lock:
            self._scan = message
            self._heard["scan"] = time.monotonic()

    def _hear_goal(self, message: Any) -> None:
        with self._lock:
            self._goal = read_vector(message)

    def now(self) -> float:
        """Return the current ROS time [s], which may stop or jump back."""
        import rospy

        return float(rospy.get_time())

    def state(self) -> State | None:
        """Return the most recent state, or None if some measurements have not been received yet."""
        with self._lock:
            if -math.inf in self._heard.values():
                return None
            both = np.array([self._joints[name] for name in self._mirror.joint_names])
            base, scan = self._base, self._scan
        scans = {name: rays_of(scan, lidar) for name, lidar in self._mirror.lidars.items()}
        return State(both[:, 0], both[:, 1], base, scans)

    def silent(self) -> tuple[str, float]:
        """Return the name of the oldest measurement, and the time since this measurement was received [s]."""
        with self._lock:
            what = min(self._heard, key=self._heard.__getitem__)
            return what, time.monotonic() - max(self._heard[what], self._began)

    def new_goal(self) -> Floats | None:
        """Return the goal, (3,) [m], that was received since the last call, or None if no goal was received."""
        with self._lock:
            goal, self._goal = self._goal, None
        return goal

    def send(self, command: Command, seconds: float) -> None:
        """Publish a command. The duration of a trajectory command is ``seconds`` [s]."""
        self._holds.clear()
        self._publisher.publish(self._message(command, seconds))

    def hold(self, command: Command, seconds: float) -> None:
        """Publish the robot's last command until it has been sent to every subscriber.

        rospy sends messages from another thread, and discards unsent messages when the node shuts down.

        Raises:
            RosError: The command was not sent within five seconds.
        """
        before = self._sent()

        def is_sent() -> bool:
            self.send(command, seconds)
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

    def is_over(self) -> bool:
        """Return whether the node is shutting down."""
        return self._ending.is_set()

    def _end(self) -> None:
        """Delay the shutdown of the node until the robot has been commanded to hold its position."""
        self._ending.set()
        self._holds.wait(2.0 * _PATIENCE)

    def _sent(self) -> dict[int, int]:
        """Return the number of commands that were sent on each open connection."""
        _, _, connections = self._publisher.impl.get_stats()
        return {number: count for number, _, count, is_open in connections if is_open}

    def _ordered(self, command: Command) -> list[float]:
        values = dict(zip(self._mirror.joint_names, command.values.tolist(), strict=True))
        return [values[name] for name in self._order]

    def _trajectory(self, command: Command, seconds: float) -> Any:
        import rospy
        from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

        point = JointTrajectoryPoint(time_from_start=rospy.Duration.from_sec(seconds))
        field = {CommandMode.POSITION: "positions", CommandMode.VELOCITY: "velocities"}.get(command.mode, "effort")
        setattr(point, field, self._ordered(command))
        return JointTrajectory(joint_names=self._order, points=[point])

    def _group(self, command: Command, seconds: float) -> Any:
        from std_msgs.msg import Float64MultiArray

        return Float64MultiArray(data=self._ordered(command))

    def _twist(self, command: Command, seconds: float) -> Any:
        from geometry_msgs.msg import Twist

        drive = self._mirror.env.robot.robot.differential_drive
        assert drive is not None
        turns = dict(zip(self._mirror.joint_names, command.values.tolist(), strict=True))
        left, right = (
            drive.wheel_radius * sum(turns[name] for name in side) / len(side) for side in (drive.left, drive.right)
        )
        message = Twist()
        message.linear.x, message.angular.z = (left + right) / 2.0, (right - left) / drive.separation
        return message
