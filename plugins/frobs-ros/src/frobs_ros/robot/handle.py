"""The handle of a robot behind ROS topics, which subscribes to the robot's measurements."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, MeasuredBody, MeasuredRobot
from frobs_core.description import Body, Placement
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError, check_name
from frobs_ros.bridge.poses import REST, place_of, read_pose, read_twist
from frobs_ros.messages.types import find_type
from frobs_ros.robot.scans import rays_of
from frobs_ros.ros.names import resolve


@dataclass(frozen=True)
class Topics:
    """Topics of a robot. Relative names are resolved in the robot's namespace.

    Attributes:
        joint_states: Topic of the joint states (sensor_msgs/JointState). Several nodes may publish on this topic.
        odom: Topic of the odometry of a moving base (nav_msgs/Odometry).
        scan: Topic of the lidar's scans (sensor_msgs/LaserScan).
        cmd_vel: Topic of the velocity commands for a wheeled robot without a named controller (geometry_msgs/Twist).
    """

    joint_states: str = "joint_states"
    odom: str = "odom"
    scan: str = "scan"
    cmd_vel: str = "cmd_vel"


class RosRobot(MeasuredRobot):
    """A robot behind ROS topics, as measured at the last call of :meth:`read`.

    Args:
        name: Name in the simulation.
        placement: Placement of the robot.
        namespace: ROS namespace of the robot.
        topics: Topics of the robot.
        speed: Fraction of the velocity limits that commands may use.
        home: Whether resets drive the robot home. Otherwise, the robot stays where it is, also if a task places it.

    Attributes:
        odom_frame: Frame of the most recent odometry message.

    Raises:
        ConfigurationError: The robot has several lidars.
    """

    def __init__(
        self, name: str, placement: Placement, namespace: str, topics: Topics, speed: float, home: bool
    ) -> None:
        import rospy

        self.describe(name, placement, 1)
        lidars = placement.robot.lidars
        if len(lidars) > 1:
            raise ConfigurationError(f"the robot has the lidars {', '.join(lidars)}, but only one lidar is supported.")
        self._speed, self._goes_home = speed, home
        self._lock, self._began = threading.Lock(), time.monotonic()
        self._joints: dict[str, tuple[float, float, float]] = {}
        self._base = self._latest_base = (*place_of(placement.pose), *REST)
        self._scan: Any = None
        self._latest_scan: Any = None
        self.measured = np.zeros((3, 1, self.dof))
        self.odom_frame = "odom"
        measured = {"joint states": (topics.joint_states, "sensor_msgs/JointState", self._hear_joints)}
        if placement.robot.base != "fixed":
            measured["odometry"] = topics.odom, "nav_msgs/Odometry", self._hear_odometry
        if lidars:
            measured["scan"] = topics.scan, "sensor_msgs/LaserScan", self._hear_scan
        self._heard = dict.fromkeys(measured, -math.inf)
        self.subscribers = [
            rospy.Subscriber(resolve(namespace, topic), find_type(kind), hear, queue_size=1, tcp_nodelay=True)
            for topic, kind, hear in measured.values()
        ]

    def _hear_joints(self, message: Any) -> None:
        columns = [each or [0.0] * len(message.name) for each in (message.position, message.velocity, message.effort)]
        with self._lock:
            self._joints.update(zip(message.name, zip(*columns, strict=True), strict=True))
            if all(name in self._joints for name in self.joint_names):
                self._heard["joint states"] = time.monotonic()

    def _hear_odometry(self, message: Any) -> None:
        place = read_pose(message.pose.pose)
        motion = read_twist(message.twist.twist).turned(place.quat_wxyz)  # it is expressed in the frame of the base
        with self._lock:
            self.odom_frame = message.header.frame_id
            self._latest_base = (*place, *motion)
            self._heard["odometry"] = time.monotonic()

    def _hear_scan(self, message: Any) -> None:
        with self._lock:
            self._latest_scan = message
            self._heard["scan"] = time.monotonic()

    def silent(self) -> tuple[str, float]:
        """Return the name of the oldest measurement, and the time since this measurement was received [s]."""
        with self._lock:
            what = min(self._heard, key=self._heard.__getitem__)
            return what, time.monotonic() - max(self._heard[what], self._began)

    @property
    def is_measured(self) -> bool:
        """Whether all measurements have been received."""
        return -math.inf not in self._heard.values()

    def read(self) -> None:
        """Use the latest measurements. All of them must have been received."""
        with self._lock:
            self.measured = np.array([self._joints[name] for name in self.joint_names]).T[:, None]
            self._base, self._scan = self._latest_base, self._latest_scan

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        """Pose of the root link in the frame of the odometry, or in the world frame if the base is fixed."""
        return self._base[0][None], self._base[1][None]

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        """Twist of the root link: lin_vel_world (1, 3) [m/s] and ang_vel_world (1, 3) [rad/s]."""
        return self._base[2][None], self._base[3][None]

    def lidar(self, name: str) -> Floats:
        """Return the measured ranges along the rays of the lidar, (1, rays) [m].

        Raises:
            ConfigurationError: The scan does not cover all rays.
        """
        lidar = self.robot.lidars[check_name("lidar", name, self.robot.lidars)]
        ranges = np.nan_to_num(rays_of(self._scan, lidar), nan=lidar.range_max, posinf=lidar.range_max)
        return np.clip(ranges, lidar.range_min, lidar.range_max)[None]

    # A robot that stays where it is ignores where a task places it.

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        if self._goes_home:
            super().write_joint_state(positions, velocities, mask)

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        if self._goes_home:
            super().write_base_pose(pos, quat_wxyz, mask)

    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        if self._goes_home:
            super().write_base_twist(lin_vel_world, ang_vel_world, mask)

    def safe_command(self, decimation: int, duration: float) -> Floats:
        """Return the command at the end of the next step, clipped to the joint limits, (dof,).

        A commanded position is also clipped to the range that the joint can reach within the step.

        Args:
            decimation: Number of physics steps.
            duration: Duration of the step [s].
        """
        asked, mode = self._take_commands(decimation)[0, -1], self.command_mode
        fastest = self._speed * self.velocity_limit[0]
        if mode is CommandMode.POSITION:
            reach, measured = fastest * duration, self.joint_positions[0]
            near = np.clip(asked, measured - reach, measured + reach)
            return np.clip(near, self.position_lower[0], self.position_upper[0])
        most = fastest if mode is CommandMode.VELOCITY else self.effort_limit[0]
        return np.clip(asked, -most, most)


class RosBody(MeasuredBody):
    """A body whose pose a topic reports. Without a topic, the body is where the scene or the task places it.

    Args:
        name: Name in the scene.
        body: Description of the body.
        topic: Topic with ``geometry_msgs/PoseStamped`` in the world frame, or None.
    """

    def __init__(self, name: str, body: Body, topic: str | None) -> None:
        import rospy

        super().__init__(name, body.pose)
        self.subscribers = []
        if topic is not None:
            kind = find_type("geometry_msgs/PoseStamped")
            self.subscribers.append(rospy.Subscriber(topic, kind, lambda new: self.measure(*read_pose(new.pose))))

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        """Set the pose, unless a topic reports it."""
        if not self.subscribers:
            self.measure(np.array(pos), self.pose[1] if quat_wxyz is None else np.array(quat_wxyz))
