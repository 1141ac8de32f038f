"""Differential-drive plugins, such as libgazebo_ros_diff_drive.so, which require no controller manager."""

from __future__ import annotations

import math

from frobs_core.contracts import CommandMode
from frobs_core.description import DifferentialDrive
from frobs_core.util.errors import check_name
from frobs_core.util.rotations import quat_conjugate
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.differential_drive import DriveSettings, Driving
from frobs_ros.bridge.gazebo_elements import Plugin
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import Motion, Place
from frobs_ros.bridge.world import World
from frobs_ros.ros.names import resolve


class DrivePlugin(Driving):
    """A differential drive.

    Args:
        world: World that contains the robot.
        model: The robot.
        settings: Settings of the drive.
        rate: Rate of the odometry [Hz].
        truth: Whether the odometry contains the true pose instead of a pose computed from the wheels.
    """

    def __init__(
        self, world: World, model: Model, settings: DriveSettings, *, rate: float = 50.0, truth: bool = True
    ) -> None:
        super().__init__(rate)
        self._truth = truth
        self.connect(model, settings)
        self._take_over(world)

    def where(self) -> tuple[Place, Motion]:
        """Return the true pose and velocity, or the values computed from the wheels."""
        if not self._truth:
            return super().where()
        place = self._model.place()
        return place, self._model.motion().turned(quat_conjugate(place.quat_wxyz))

    def reset(self, world: World) -> None:
        """Reset the drive."""
        super().reset(world)
        self._take_over(world)

    def _take_over(self, world: World) -> None:
        for column in (*self._left, *self._right):
            self._model.joint_targets.set_mode(column, CommandMode.VELOCITY, self._model.handle)
        self.begin(world)


def make_diff_drive(bridge: Bridge, model: Model, plugin: Plugin, space: str) -> DrivePlugin:
    """Create the drive of libgazebo_ros_diff_drive.so.

    Raises:
        UnknownNameError: A configured wheel joint does not exist in the robot.
        ConfigurationError: A parameter is invalid.
    """
    wheels = _wheels(
        plugin,
        model,
        (plugin.text("leftJoint", default="left_joint"), plugin.text("rightJoint", default="right_joint")),
        plugin.number("wheelSeparation", default=0.34),
        plugin.number("wheelDiameter", default=0.15),
        plugin.number("wheelAcceleration", default=0.0),
    )
    settings = DriveSettings(
        wheels=wheels,
        command=resolve(space, plugin.text("commandTopic", default="cmd_vel")),
        odom=resolve(space, plugin.text("odometryTopic", default="odom")),
        frame=plugin.text("odometryFrame", default="odom"),
        child=plugin.text("robotBaseFrame", default="base_footprint"),
        tf=plugin.says("publishOdomTF", plugin.says("publishTf", True)),
    )
    truth = plugin.text("odometrySource", default="world") not in ("encoder", "0")
    return DrivePlugin(bridge.world, model, settings, rate=plugin.number("updateRate", default=100.0), truth=truth)


def make_kobuki(bridge: Bridge, model: Model, plugin: Plugin, space: str) -> DrivePlugin:
    """Create the drive of libgazebo_ros_kobuki.so. See :func:`make_diff_drive`."""
    left = plugin.text("left_wheel_joint_name", default="wheel_left_joint")
    right = plugin.text("right_wheel_joint_name", default="wheel_right_joint")
    separation, diameter = (
        plugin.number("wheel_separation", default=0.23),
        plugin.number("wheel_diameter", default=0.07),
    )
    settings = DriveSettings(
        wheels=_wheels(plugin, model, (left, right), separation, diameter),
        command=resolve(space, "mobile_base/commands/velocity"),
        odom=resolve(space, "odom"),
        frame="odom",
        child=plugin.text("base_frame", default="base_footprint"),
        tf=plugin.says("publish_tf", True),
        timeout=plugin.number("velocity_command_timeout", default=0.6),
    )
    return DrivePlugin(bridge.world, model, settings, truth=False)


def _wheels(
    plugin: Plugin,
    model: Model,
    joints: tuple[str, str],
    separation: float,
    diameter: float,
    acceleration: float = 0.0,
) -> DifferentialDrive:
    for joint in joints:
        check_name(f"wheel of '{model.name}' for the plugin '{plugin.name}'", joint, model.joints)
    radius = diameter / 2.0
    if not (separation > 0.0 and radius > 0.0):
        raise plugin.error(
            f"the wheel separation is {separation} m and the wheel radius is {radius} m; both must be above 0."
        )
    return DifferentialDrive(
        left=joints[:1],
        right=joints[1:],
        separation=separation,
        wheel_radius=radius,
        max_linear_velocity=math.inf,
        max_angular_velocity=math.inf,
        max_linear_acceleration=acceleration or None,
        # Both wheels accelerate at their limit, in opposite directions.
        max_angular_acceleration=2.0 * acceleration / separation or None,
    )
