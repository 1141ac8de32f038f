"""Plugins that publish laser scans and the true poses of links."""

from __future__ import annotations

import math

import numpy as np

from frobs_core.description import Lidar
from frobs_core.util.rotations import quat_conjugate
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.differential_drive import odometry
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import World


class Scan(Component):
    """Publisher of a lidar's ``sensor_msgs/LaserScan``, in which rays without a hit have the range inf, as in Gazebo.

    Args:
        sensor: Name of the lidar.
        noise: Standard deviation of the added noise [m].
    """

    def __init__(self, model: Model, sensor: str, topic: str, frame: str, noise: float = 0.0) -> None:
        self._lidar: Lidar = model.placement().robot.lidars[sensor]
        super().__init__(self._lidar.rate or 100.0)
        self._model, self._sensor, self._noise = model, sensor, noise
        self._random = np.random.default_rng(0)
        self._publisher = self.publisher(topic, "sensor_msgs/LaserScan")
        angles = self._lidar.angles
        self._fixed = {
            "angle_min": float(angles[0]),
            "angle_max": float(angles[-1]),
            "angle_increment": float(angles[1] - angles[0]) if len(angles) > 1 else 0.0,
            "range_min": self._lidar.range_min,
            "range_max": self._lidar.range_max,
            "scan_time": 1.0 / (self._lidar.rate or 100.0),
        }
        self._frame = frame

    def tell(self, world: World) -> None:
        if self._publisher.get_num_connections() == 0:
            return
        ranges = self._model.handle.lidar(self._sensor)[0]
        nothing = ranges >= self._lidar.range_max
        if self._noise:
            noisy = ranges + self._random.normal(0.0, self._noise, len(ranges))
            ranges = np.clip(noisy, self._lidar.range_min, self._lidar.range_max)
        ranges = np.where(nothing, math.inf, ranges).tolist()
        self._publisher.publish(header=self.header(world, self._frame), ranges=ranges, **self._fixed)


class Truth(Component):
    """Publisher of a link's true pose and twist as ``nav_msgs/Odometry``, for libgazebo_ros_p3d.so."""

    def __init__(self, model: Model, link: str, topic: str, frame: str, rate: float) -> None:
        super().__init__(rate)
        self._model, self._link, self._frame = model, link, frame
        self._publisher = self.publisher(topic, "nav_msgs/Odometry")

    def tell(self, world: World) -> None:
        if self._publisher.get_num_connections() == 0:
            return
        place = self._model.link_place(self._link)
        motion = self._model.link_motion(self._link).turned(quat_conjugate(place.quat_wxyz))
        self._publisher.publish(odometry(self.header(world, self._frame), self._link, place, motion)[0])
