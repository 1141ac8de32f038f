"""The handle of a robot behind ROS topics, which subscribes to the robot's measurements."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from frobs_core.contracts import MeasuredBody, MeasuredRobot
from frobs_core.description import Placement
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, check_name
from frobs_ros.bridge.poses import REST, place_of, read_pose, read_twist
from frobs_ros.messages.types import find_type
from frobs_ros.robot.scans import rays_of
from frobs_ros.ros.names import resolve


class RosRobot(MeasuredRobot):
    """A robot behind ROS topics, as measured at the last call of :meth:`read`.

    Args:
        name: Name in the simulation.
        placement: Placement of the robot.

    Attributes:
        odom_frame: Frame of the most recent odometry message.

    Raises:
        ConfigurationError: The robot has several lidars.
    """

    def __init__(self, name: str, placement: Placement) -> None:
        self.describe(name, placement, 1)
        lidars = placement.robot.lidars
        if len(lidars) > 1:
            raise ConfigurationError(f"the robot has the lidars {', '.join(lidars)}, but only one lidar is supported.")
        self._lock = threading.Lock()
        self._joints: dict[str, tuple[float, ...]] = {}  # time [s], position, velocity and effort of each joint
        self._base = self._latest_base = (*place_of(placement.pose), *REST)
        self._scan: Any = None
        self._latest_scan: Any = None
        self.measured = np.zeros((3, 1, self.dof))
        self.odom_frame = "odom"

    def subscribe(
        self, namespace: str, topics: Mapping[str, str], bodies: Sequence[tuple[MeasuredBody, str]]
    ) -> list[Any]:
        """Subscribe to the measurements.

        Args:
            namespace: ROS namespace of the robot.
            topics: Names of the topics ``joint_states``, ``odom`` and ``scan``.
            bodies: Bodies and the topics of their poses.

        Returns:
            The subscribers.
        """
        import rospy

        measured = {"joint states": (topics["joint_states"], "sensor_msgs/JointState", self._hear_joints)}
        if self.robot.base != "fixed":
            measured["odometry"] = topics["odom"], "nav_msgs/Odometry", self._hear_odometry
        if self.robot.lidars:
            measured["scan"] = topics["scan"], "sensor_msgs/LaserScan", self._hear_scan
        for body, topic in bodies:
            hear = partial(self._hear_pose, body)
            measured[f"pose of {body.name}"] = topic, "geometry_msgs/PoseStamped", hear
        self._began, self._heard = time.monotonic(), dict.fromkeys(measured, -math.inf)
        return [
            rospy.Subscriber(resolve(namespace, topic), find_type(kind), hear, queue_size=1, tcp_nodelay=True)
            for topic, kind, hear in measured.values()
        ]

    def _hear_joints(self, message: Any) -> None:
        columns = [each or [0.0] * len(message.name) for each in (message.position, message.velocity, message.effort)]
        rows, now = zip(message.name, *columns, strict=True), time.monotonic()
        with self._lock:
            self._joints |= {name: (now, *values) for name, *values in rows if all(map(math.isfinite, values[:2]))}
            if all(name in self._joints for name in self.joint_names):  # each may come from another node
                self._heard["joint states"] = min((self._joints[name][0] for name in self.joint_names), default=now)

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

    def _hear_pose(self, body: MeasuredBody, message: Any) -> None:
        body.measure(*read_pose(message.pose))
        self._heard[f"pose of {body.name}"] = time.monotonic()

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
            self.measured = np.array([self._joints[name][1:] for name in self.joint_names]).T[:, None]
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
        return np.asarray(np.clip(ranges, lidar.range_min, lidar.range_max)[None])
