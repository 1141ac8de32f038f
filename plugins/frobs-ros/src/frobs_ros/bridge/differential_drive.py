"""Differential drives, which convert velocity commands to wheel speeds, and compute odometry from wheel angles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.models import BANDWIDTH
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import Motion, Place, write_pose, write_twist
from frobs_ros.bridge.world import NANO, World

_RENEWED = 0.005  # time [s] between two commands while the speed is changing


@dataclass(frozen=True, kw_only=True)
class Base:
    """Parameters of a base with a differential drive.

    Attributes:
        left: Indices of the left wheels in the robot's joint arrays.
        right: Indices of the right wheels.
        separation: Distance between the left and right wheels [m].
        radius: Radius of a wheel [m].
        max_linear: Maximum linear speed [m/s].
        max_angular: Maximum angular speed [rad/s].
        linear_acceleration: Maximum linear acceleration [m/s²].
        angular_acceleration: Maximum angular acceleration [rad/s²].
        timeout: Time without a new command after which the base stops [s], or inf for no timeout.
        stiff: Whether to increase the wheels' drive gains to account for the robot's mass.
    """

    left: tuple[int, ...]
    right: tuple[int, ...]
    separation: float
    radius: float
    max_linear: float = math.inf
    max_angular: float = math.inf
    linear_acceleration: float = math.inf
    angular_acceleration: float = math.inf
    timeout: float = math.inf
    stiff: bool = True


class Driver:
    """Driver that follows the latest twist and computes the odometry of the base.

    Attributes:
        place: Odometry pose of the base, relative to the start pose.
        motion: Odometry velocity of the base, in the base frame.
    """

    def __init__(self, model: Model, base: Base) -> None:
        self._model, self._base = model, base
        self._new: tuple[float, float] | None = None
        self._wanted = self._present = (0.0, 0.0)
        self._since = 0.0
        self._turned = (0.0, 0.0)
        self._x = self._y = self._yaw = 0.0
        self.motion = Motion(np.zeros(3), np.zeros(3))

    def take(self, twist: Any) -> None:
        """Store a received geometry_msgs/Twist. Called in a rospy thread."""
        linear, angular = float(twist.linear.x), float(twist.angular.z)
        if math.isfinite(linear) and math.isfinite(angular):
            self._new = linear, angular

    def start(self, world: World) -> None:
        """Stop the base and use its current pose as the odometry origin."""
        if self._base.stiff:
            self._stiffen(world)
        self._new, self._wanted, self._present = None, (0.0, 0.0), (0.0, 0.0)
        self._turned = self._angles()
        self._x = self._y = self._yaw = 0.0
        self.motion = Motion(np.zeros(3), np.zeros(3))

    def command(self, world: World, steps: int) -> None:
        """Set the wheels' targets for the next physics steps."""
        base, now, span = self._base, world.time_ns / NANO, steps * world.timestep
        new, self._new = self._new, None
        if new is not None:
            self._wanted, self._since = new, now
        elif now - self._since > base.timeout:
            self._wanted = 0.0, 0.0
        limits = (base.max_linear, base.linear_acceleration), (base.max_angular, base.angular_acceleration)
        linear, angular = (
            _towards(present, max(-most, min(most, requested)), change * span)
            for present, requested, (most, change) in zip(self._present, self._wanted, limits, strict=True)
        )
        self._present = linear, angular
        targets = self._model.joint_targets.targets
        targets[list(base.left)] = (linear - angular * base.separation / 2.0) / base.radius
        targets[list(base.right)] = (linear + angular * base.separation / 2.0) / base.radius

    @property
    def is_changing(self) -> bool:
        """Whether the speed is changing under an acceleration limit, which requires frequent commands."""
        base = self._base
        limited = math.isfinite(base.linear_acceleration) or math.isfinite(base.angular_acceleration)
        return limited and (self._present != self._wanted or self._new is not None)

    def reckon(self, span: float) -> None:
        """Update the odometry from the wheels' rotation during the last ``span`` [s]."""
        base, before = self._base, self._turned
        self._turned = self._angles()
        left, right = ((now - then) * base.radius for now, then in zip(self._turned, before, strict=True))
        ahead, turn = 0.5 * (left + right), (right - left) / base.separation
        middle = self._yaw + 0.5 * turn
        self._x += ahead * math.cos(middle)
        self._y += ahead * math.sin(middle)
        self._yaw += turn
        self.motion = Motion(np.array([ahead / span, 0.0, 0.0]), np.array([0.0, 0.0, turn / span]))

    @property
    def place(self) -> Place:
        """Odometry pose of the base, relative to the start pose."""
        quat = np.array([math.cos(self._yaw / 2.0), 0.0, 0.0, math.sin(self._yaw / 2.0)])
        return Place(np.array([self._x, self._y, 0.0]), quat)

    def _stiffen(self, world: World) -> None:
        """Increase the wheels' drive gains to account for the robot's mass, using the default drive bandwidth.

        By default, a joint's gains account only for the links that it carries, but wheels must move the whole robot.
        """
        placement, robot, base = self._model.description.placement, self._model.robot, self._base
        assert placement is not None
        assert robot is not None
        mass = sum(link.inertial.mass for link in placement.model.links if link.inertial is not None)
        wheels = [*base.left, *base.right]
        damping = robot.drive_gains()[1].copy()
        least = 2.0 * (2.0 * math.pi * BANDWIDTH) * mass * base.radius**2 / len(wheels)
        if (damping[0, wheels] < least).any():
            damping[0, wheels] = np.maximum(damping[0, wheels], least)
            world.write_parameter("damping", self._model.key, damping)

    def _angles(self) -> tuple[float, float]:
        robot = self._model.robot
        assert robot is not None
        angles = robot.joint_positions[0]
        return float(angles[list(self._base.left)].mean()), float(angles[list(self._base.right)].mean())


def _towards(present: float, requested: float, most: float) -> float:
    return present + max(-most, min(most, requested - present))


class Driving(Component):
    """Component for a differential drive, which subscribes to twists and publishes odometry."""

    def listen(self, driver: Driver, command: str, odom: str, frames: tuple[str, str], tf: bool) -> None:
        """Create the subscriber and the publishers. Constructors must call this method last."""
        import rospy
        from geometry_msgs.msg import Twist
        from nav_msgs.msg import Odometry
        from tf2_msgs.msg import TFMessage

        self._driver, self._frames, self._last_ns = driver, frames, 0
        self.own(rospy.Subscriber(command, Twist, driver.take, queue_size=1, tcp_nodelay=True))
        self._odom = self.own(rospy.Publisher(odom, Odometry, queue_size=10, tcp_nodelay=True))
        self._tf = self.own(rospy.Publisher("/tf", TFMessage, queue_size=10, tcp_nodelay=True)) if tf else None

    def most_steps(self, world: World) -> int | None:
        """Return a small number of steps while the speed is changing, and None otherwise."""
        return max(1, round(_RENEWED / world.timestep)) if self._driver.is_changing else None

    def before(self, world: World, steps: int) -> None:
        """Set the wheels' targets."""
        self._driver.command(world, steps)

    def where(self) -> tuple[Place, Motion]:
        """Return the odometry's pose and velocity, computed from the wheels' rotation."""
        return self._driver.place, self._driver.motion

    def tell(self, world: World) -> None:
        """Publish the odometry."""
        span, self._last_ns = (world.time_ns - self._last_ns) / NANO, world.time_ns
        if span <= 0.0:
            return
        self._driver.reckon(span)
        odom, transform = odometry(*self._frames, self.next_stamp(world), *self.where())
        self._odom.publish(odom)
        if self._tf is not None:
            self._tf.publish([transform])


def odometry(frame: str, child: str, stamp: Any, place: Place, motion: Motion) -> tuple[Any, Any]:
    """Return a nav_msgs/Odometry message and a geometry_msgs/TransformStamped message with the same pose."""
    from geometry_msgs.msg import TransformStamped
    from nav_msgs.msg import Odometry

    odom = Odometry(child_frame_id=child)
    odom.header.frame_id, odom.header.stamp = frame, stamp
    write_pose(place, odom.pose.pose)
    write_twist(motion, odom.twist.twist)
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id, transform.header.stamp = frame, stamp
    at, turn = transform.transform.translation, transform.transform.rotation
    at.x, at.y, at.z = place.pos.tolist()
    turn.w, turn.x, turn.y, turn.z = place.quat_wxyz.tolist()
    return odom, transform
