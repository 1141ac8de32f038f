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

from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import check_name
from frobs_core.util.rotations import quat_conjugate, quat_from_rpy, quat_multiply, quat_rotate
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.gazebo_elements import Plugin
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.plugins.differential_drive import topic
from frobs_ros.bridge.poses import WORLD, Motion, Place
from frobs_ros.bridge.world import NANO, World
from frobs_ros.errors import GazeboElementError

_USUAL_RATE = 100.0  # default rate [Hz], whereas Gazebo publishes after each physics step by default


@dataclass(frozen=True)
class Mount:
    """Mounting pose of a sensor on a link."""

    model: Model
    link: str
    offset: Place = WORLD

    def place(self) -> Place:
        """Return the sensor's pose in the world frame."""
        return self.offset.after(self.model.link_place(self.link))

    def motion(self) -> Motion:
        """Return the sensor's velocity in the world frame."""
        linear, angular = self.model.link_motion(self.link)
        lever = quat_rotate(self.model.link_place(self.link).quat_wxyz, self.offset.pos)
        return Motion(linear + np.cross(angular, lever), angular)


@dataclass(frozen=True, kw_only=True)
class ImuSettings:
    """Settings for publishing IMU measurements.

    Attributes:
        rate: Publishing rate [Hz].
        noise: Standard deviation of the noise on each number.
        turn: Quaternion (wxyz) of ``rpyOffset``.
        turns_vectors: Whether ``turn`` also applies to angular velocity and acceleration.
        with_gravity: Whether gravity is subtracted from the acceleration.
        relative: Whether the orientation is reported relative to the initial orientation.
    """

    topic: str
    frame: str
    rate: float
    noise: float
    turn: Floats
    turns_vectors: bool
    with_gravity: bool
    relative: bool = False


def read_imu(plugin: Plugin, model: Model, space: str) -> tuple[Mount, ImuSettings]:
    """Read the parameters of libgazebo_ros_imu.so.

    Raises:
        UnknownNameError: The model does not contain the link.
        ConfigurationError: A parameter is not a number.
    """
    link = plugin.text("bodyName").rpartition("::")[2]
    return _mount(plugin, model, link, WORLD), ImuSettings(
        topic=topic(space, plugin.text("topicName", default="/default_imu")),
        frame=plugin.text("frameName", default=link).strip("/"),
        rate=plugin.number("updateRate", default=0.0) or _USUAL_RATE,
        noise=plugin.number("gaussianNoise", default=0.0),
        turn=quat_from_rpy(plugin.numbers("rpyOffset", 3)),
        turns_vectors=True,
        with_gravity=False,
    )


def read_imu_sensor(plugin: Plugin, model: Model, space: str) -> tuple[Mount, ImuSettings]:
    """Read the parameters of libgazebo_ros_imu_sensor.so.

    Raises:
        UnknownNameError: The model does not contain the sensor's link.
        ConfigurationError: The plugin does not belong to a sensor, or a parameter is not a number.
    """
    sensor = plugin.sensor
    if sensor is None:
        raise GazeboElementError(f"the plugin '{plugin.name}'", 'the plugin must be inside a <sensor type="imu">.')
    rates = [rate for rate in (sensor.rate, plugin.number("updateRateHZ", default=1.0)) if rate > 0.0]
    return _mount(plugin, model, sensor.link, sensor.place), ImuSettings(
        topic=topic(space, plugin.text("topicName", default="imu_data")),
        frame=plugin.text("frameName", default=sensor.link).strip("/"),
        rate=min(rates, default=_USUAL_RATE),
        noise=plugin.number("gaussianNoise", default=0.0),
        turn=quat_from_rpy(plugin.numbers("rpyOffset", 3)),
        turns_vectors=False,
        with_gravity=True,
        relative=plugin.says("initialOrientationAsReference", False),
    )


def _mount(plugin: Plugin, model: Model, link: str, offset: Place) -> Mount:
    check_name(f"link of '{model.name}' for the plugin '{plugin.name}'", link, model.links)
    return Mount(model, link, offset)


class ImuTopic(Component):
    """Publisher of a sensor's ``sensor_msgs/Imu``.

    The first sample after a subscription is skipped, because the acceleration requires two samples.
    """

    def __init__(self, mount: Mount, settings: ImuSettings) -> None:
        import rospy
        from sensor_msgs.msg import Imu

        super().__init__(settings.rate)
        self._mount, self._settings = mount, settings
        self._random = np.random.default_rng(0)
        self._reference = quat_conjugate(mount.place().quat_wxyz) if settings.relative else WORLD.quat_wxyz
        self._last: tuple[int, Floats] | None = None
        self._publisher = self.own(rospy.Publisher(settings.topic, Imu, queue_size=1, tcp_nodelay=True))

    def tell(self, world: World) -> None:
        """Publish if there are subscribers."""
        if self._publisher.get_num_connections() == 0:
            self._last = None
            return
        (linear, angular), settings = self._mount.motion(), self._settings
        last, self._last = self._last, (world.time_ns, linear)
        if last is None or last[0] == world.time_ns:
            return
        acceleration = (linear - last[1]) * (NANO / (world.time_ns - last[0]))
        if settings.with_gravity:
            acceleration = acceleration - np.array(world.gravity)
        quat = self._mount.place().quat_wxyz
        turned = quat_multiply(settings.turn, quat_multiply(self._reference, quat))
        axes = quat_conjugate(turned if settings.turns_vectors else quat)
        self._publisher.publish(
            self._message(self.next_stamp(world), turned, quat_rotate(axes, angular), quat_rotate(axes, acceleration))
        )

    def reset(self, world: World) -> None:
        """Reset the sensor, so that resetting the model is not measured as an acceleration."""
        super().reset(world)
        self._last = None

    def _message(self, stamp: Any, quat: Floats, angular: Floats, acceleration: Floats) -> Any:
        message, noise = self._publisher.data_class(), self._settings.noise
        message.header.stamp, message.header.frame_id = stamp, self._settings.frame
        w, x, y, z, *vectors = np.concatenate([quat, angular, acceleration]) + noise * self._random.normal(size=10)
        for part, numbers in (
            (message.orientation, (x, y, z, w)),
            (message.angular_velocity, vectors[:3]),
            (message.linear_acceleration, vectors[3:]),
        ):
            for name, number in zip(part.__slots__, numbers, strict=True):
                setattr(part, name, float(number))
        variances = [noise * noise if place % 4 == 0 else 0.0 for place in range(9)]
        message.orientation_covariance = message.angular_velocity_covariance = variances
        message.linear_acceleration_covariance = variances
        return message
