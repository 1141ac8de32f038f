"""The plugins libgazebo_ros_imu.so and libgazebo_ros_imu_sensor.so, which publish IMU measurements.

The measurements are orientation, angular velocity and linear acceleration. As in gazebo_ros, the two plugins treat
gravity differently:

- ``gazebo_ros_imu`` (a plugin of the model) reports the link's acceleration without gravity, which is 0 at rest.
- ``gazebo_ros_imu_sensor`` (in a ``<sensor type="imu">``) reports the specific force (acceleration minus gravity),
  which is +9.8 m/s² along z for an upright sensor at rest.

Both plugins report the orientation in the world frame, and vectors in the sensor frame. The acceleration is the change
in the sensor's velocity since the last message, divided by the elapsed time. ``rpyOffset`` rotates the reported
orientation about the world axes. With ``gazebo_ros_imu``, vectors are also reported in this rotated frame.
``xyzOffset`` has no effect, as in gazebo_ros. ``gaussianNoise`` is the standard deviation of the noise on each number,
and the diagonal of each covariance matrix contains the square of this standard deviation.

Gazebo's gazebo_ros_imu rotates vectors by the link's orientation instead of its inverse, so its vectors are in the link
frame only while the link is level. In the bridge, the vectors are in the link frame at any orientation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import check_name
from frobs_core.util.rotations import quat_conjugate, quat_from_rpy, quat_multiply, quat_rotate
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.gazebo_elements import Plugin
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import WORLD, Motion, Place
from frobs_ros.bridge.world import NANO, World
from frobs_ros.ros.names import resolve

_USUAL_RATE = 100.0  # default rate [Hz], whereas Gazebo publishes after each physics step by default


class ImuTopic(Component):
    """Publisher of a sensor's ``sensor_msgs/Imu``.

    The first sample after a subscription is skipped, because the acceleration requires two samples.

    Args:
        model: Model that carries the sensor.
        plugin: Parameters of gazebo_ros_imu or gazebo_ros_imu_sensor.
        space: Namespace of the topic: either empty or beginning with a slash.

    Raises:
        UnknownNameError: The model does not contain the sensor's link.
        ConfigurationError: A parameter is invalid, or gazebo_ros_imu_sensor does not belong to a sensor.
    """

    def __init__(self, model: Model, plugin: Plugin, space: str) -> None:
        self._in_sensor = plugin.file == "gazebo_ros_imu_sensor"
        if self._in_sensor:
            if plugin.sensor is None:
                raise plugin.error('the plugin must be inside a <sensor type="imu">.')
            link, self._offset, usual_topic = plugin.sensor.link, plugin.sensor.place, "imu_data"
            rate = plugin.lowest_rate("updateRateHZ", 1.0, _USUAL_RATE)
        else:
            link, self._offset, usual_topic = plugin.text("bodyName").rpartition("::")[2], WORLD, "/default_imu"
            rate = plugin.number("updateRate", default=0.0) or _USUAL_RATE
        check_name(f"link of '{model.name}' for the plugin '{plugin.name}'", link, model.links)
        super().__init__(rate)
        self._model, self._link = model, link
        self._frame = plugin.text("frameName", default=link).strip("/")
        self._noise = plugin.number("gaussianNoise", default=0.0)
        self._turn = quat_from_rpy(plugin.numbers("rpyOffset", 3))
        relative = self._in_sensor and plugin.says("initialOrientationAsReference", False)
        self._reference = quat_conjugate(self._place().quat_wxyz) if relative else WORLD.quat_wxyz
        self._random = np.random.default_rng(0)
        self._last: tuple[int, Floats] | None = None
        name = resolve(space, plugin.text("topicName", default=usual_topic))
        self._publisher = self.publisher(name, "sensor_msgs/Imu")

    def _place(self) -> Place:
        """Return the sensor's pose in the world frame."""
        return self._offset.after(self._model.link_place(self._link))

    def _motion(self) -> Motion:
        """Return the sensor's velocity in the world frame."""
        linear, angular = self._model.link_motion(self._link)
        lever = quat_rotate(self._model.link_place(self._link).quat_wxyz, self._offset.pos)
        return Motion(linear + np.cross(angular, lever), angular)

    def tell(self, world: World) -> None:
        if self._publisher.get_num_connections() == 0:
            self._last = None
            return
        linear, angular = self._motion()
        last, self._last = self._last, (world.time_ns, linear)
        if last is None or last[0] == world.time_ns:
            return
        acceleration = (linear - last[1]) * (NANO / (world.time_ns - last[0]))
        if self._in_sensor:
            acceleration = acceleration - np.array(world.gravity)
        quat = self._place().quat_wxyz
        turned = quat_multiply(self._turn, quat_multiply(self._reference, quat))
        axes = quat_conjugate(quat if self._in_sensor else turned)
        numbers = np.concatenate([turned, quat_rotate(axes, angular), quat_rotate(axes, acceleration)])
        self._publisher.publish(self._message(self.header(world, self._frame), numbers))

    def reset(self, world: World) -> None:
        """Reset the sensor, so that resetting the model is not measured as an acceleration."""
        super().reset(world)
        self._last = None

    def _message(self, header: Any, numbers: Floats) -> Any:
        """Return the message for the orientation, angular velocity and acceleration, (10,), with noise."""
        w, x, y, z, *vectors = numbers + self._noise * self._random.normal(size=10)
        message = self._publisher.data_class(header=header)
        for part, values in (
            (message.orientation, (x, y, z, w)),
            (message.angular_velocity, vectors[:3]),
            (message.linear_acceleration, vectors[3:]),
        ):
            for name, number in zip(part.__slots__, values, strict=True):
                setattr(part, name, float(number))
        variances = [self._noise**2 if place % 4 == 0 else 0.0 for place in range(9)]
        message.orientation_covariance = message.angular_velocity_covariance = variances
        message.linear_acceleration_covariance = variances
        return message
