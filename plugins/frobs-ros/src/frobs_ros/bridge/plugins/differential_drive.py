"""Differential-drive plugins, such as libgazebo_ros_diff_drive.so, which require no controller manager."""

from __future__ import annotations

import math
from dataclasses import dataclass

from frobs_core.contracts import CommandMode
from frobs_core.util.errors import check_name
from frobs_core.util.rotations import quat_conjugate
from frobs_ros.bridge.differential_drive import Base, Driver, Driving
from frobs_ros.bridge.gazebo_elements import Plugin
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import Motion, Place
from frobs_ros.bridge.world import World
from frobs_ros.errors import GazeboElementError


@dataclass(frozen=True, kw_only=True)
class DriveSettings:
    """Topics and frames of a differential drive.

    Attributes:
        child: Frame of the base.
        rate: Rate of the odometry [Hz].
        truth: Whether the odometry contains the true pose instead of a pose computed from the wheels.
    """

    command: str
    odom: str
    frame: str
    child: str
    rate: float
    truth: bool = True
    tf: bool = True


def read_diff_drive(plugin: Plugin, model: Model, space: str) -> tuple[Base, DriveSettings]:
    """Read the parameters of libgazebo_ros_diff_drive.so.

    Raises:
        UnknownNameError: A configured wheel joint does not exist in the robot.
        ConfigurationError: A parameter is invalid.
    """
    acceleration = plugin.number("wheelAcceleration", default=0.0)
    separation = plugin.number("wheelSeparation", default=0.34)
    base = _base(
        plugin,
        model,
        (plugin.text("leftJoint", default="left_joint"), plugin.text("rightJoint", default="right_joint")),
        separation,
        plugin.number("wheelDiameter", default=0.15) / 2.0,
        acceleration=acceleration,
    )
    settings = DriveSettings(
        command=topic(space, plugin.text("commandTopic", default="cmd_vel")),
        odom=topic(space, plugin.text("odometryTopic", default="odom")),
        frame=plugin.text("odometryFrame", default="odom"),
        child=plugin.text("robotBaseFrame", default="base_footprint"),
        rate=plugin.number("updateRate", default=100.0),
        truth=plugin.text("odometrySource", default="world") not in ("encoder", "0"),
        tf=plugin.says("publishOdomTF", plugin.says("publishTf", True)),
    )
    return base, settings


def read_kobuki(plugin: Plugin, model: Model, space: str) -> tuple[Base, DriveSettings]:
    """Read the parameters of libgazebo_ros_kobuki.so. See :func:`read_diff_drive`."""
    base = _base(
        plugin,
        model,
        (
            plugin.text("left_wheel_joint_name", default="wheel_left_joint"),
            plugin.text("right_wheel_joint_name", default="wheel_right_joint"),
        ),
        plugin.number("wheel_separation", default=0.23),
        plugin.number("wheel_diameter", default=0.07) / 2.0,
        timeout=plugin.number("velocity_command_timeout", default=0.6),
    )
    settings = DriveSettings(
        command=topic(space, "mobile_base/commands/velocity"),
        odom=topic(space, "odom"),
        frame="odom",
        child=plugin.text("base_frame", default="base_footprint"),
        rate=50.0,
        truth=False,
        tf=plugin.says("publish_tf", True),
    )
    return base, settings


def topic(space: str, name: str) -> str:
    """Return a topic's full name. A name that begins with a slash is returned unchanged."""
    return name if name.startswith("/") else f"{space}/{name}"


def _base(
    plugin: Plugin,
    model: Model,
    joints: tuple[str, str],
    separation: float,
    radius: float,
    acceleration: float = 0.0,
    timeout: float = math.inf,
) -> Base:
    for joint in joints:
        check_name(f"wheel of '{model.name}' for the plugin '{plugin.name}'", joint, model.joints)
    if not (separation > 0.0 and radius > 0.0):
        raise GazeboElementError(
            f"the plugin '{plugin.name}'",
            f"the wheel separation is {separation} m and the wheel radius is {radius} m; both must be above 0.",
        )
    return Base(
        left=(model.joints[joints[0]],),
        right=(model.joints[joints[1]],),
        separation=separation,
        radius=radius,
        linear_acceleration=acceleration or math.inf,
        # Both wheels accelerate at their limit, in opposite directions.
        angular_acceleration=2.0 * acceleration / separation or math.inf,
        timeout=timeout,
    )


class DrivePlugin(Driving):
    """A differential drive."""

    def __init__(self, world: World, model: Model, base: Base, settings: DriveSettings) -> None:
        super().__init__(settings.rate)
        self._model, self._truth = model, settings.truth
        self._wheels = [*base.left, *base.right]
        frames = settings.frame, settings.child
        self.listen(Driver(model, base), settings.command, settings.odom, frames, settings.tf)
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
        self._last_ns = world.time_ns
        self._take_over(world)

    def _take_over(self, world: World) -> None:
        robot = self._model.robot
        assert robot is not None
        for column in self._wheels:
            self._model.joint_targets.set_mode(column, CommandMode.VELOCITY, robot)
        self._driver.start(world)
