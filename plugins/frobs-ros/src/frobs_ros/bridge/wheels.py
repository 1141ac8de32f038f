"""Differential drive: converts twists to wheel speeds, and wheel angles to odometry."""

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

_RENEWED = 0.005  # [s] between two commands while the speed changes


@dataclass(frozen=True, kw_only=True)
class Base:
    """Parameters of a base with differential drive.

    Attributes:
        left: Indices of the left wheels in the robot's joint arrays.
        right: Indices of the right wheels.
        separation: Distance between left and right wheels [m].
        radius: Radius of a wheel [m].
        max_linear: Maximum linear speed [m/s].
        max_angular: Maximum angular speed [rad/s].
        linear_acceleration: Maximum linear acceleration [m/s²].
        angular_acceleration: Maximum angular acceleration [rad/s²].
        timeout: [s] after which an old command stops the base; inf: never.
        stiff: Whether the wheels' drives are strengthened for the robot's mass, as Gazebo's are.
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
    """Follows the last received twist, and computes the odometry of the base.

    Attributes:
        place: Pose by odometry, relative to the start.
        motion: Velocity by odometry, in the axes of the base.
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
        """Store a geometry_msgs/Twist, in rospy's thread."""
        linear, angular = float(twist.linear.x), float(twist.angular.z)
        if math.isfinite(linear) and math.isfinite(angular):
            self._new = linear, angular

    def start(self, world: World) -> None:
        """Stop the base, and define its current pose as the origin."""
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
            _towards(present, max(-most, min(most, wanted)), change * span)
            for present, wanted, (most, change) in zip(self._present, self._wanted, limits, strict=True)
        )
        self._present = linear, angular
        targets = self._model.drive.targets
        targets[list(base.left)] = (linear - angular * base.separation / 2.0) / base.radius
        targets[list(base.right)] = (linear + angular * base.separation / 2.0) / base.radius

    @property
    def is_changing(self) -> bool:
        """Whether an acceleration limit currently changes the speed, which requires frequent commands."""
        base = self._base
        limited = math.isfinite(base.linear_acceleration) or math.isfinite(base.angular_acceleration)
        return limited and (self._present != self._wanted or self._new is not None)

    def reckon(self, span: float) -> None:
        """Update the odometry with the rotation of the wheels in ``span`` [s]."""
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
        """Pose of the base by odometry."""
        quat = np.array([math.cos(self._yaw / 2.0), 0.0, 0.0, math.sin(self._yaw / 2.0)])
        return Place(np.array([self._x, self._y, 0.0]), quat)

    def _stiffen(self, world: World) -> None:
        """Strengthen the drives of the wheels for the mass that they carry, with the bandwidth of all drives.

        The gains of a drive depend on the mass that its joint carries; a wheel carries the rest of the robot.
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


def _towards(present: float, wanted: float, most: float) -> float:
    return present + max(-most, min(most, wanted - present))


class Driving(Component):
    """A component for a differential drive: subscribes to twists, and publishes odometry."""

    def listen(self, driver: Driver, command: str, odom: str, frames: tuple[str, str], tf: bool) -> None:
        """Connect to the ROS graph; the last call of a constructor."""
        import rospy
        from geometry_msgs.msg import Twist
        from nav_msgs.msg import Odometry
        from tf2_msgs.msg import TFMessage

        self._driver, self._frames, self._last_ns = driver, frames, 0
        self.own(rospy.Subscriber(command, Twist, driver.take, queue_size=1, tcp_nodelay=True))
        self._odom = self.own(rospy.Publisher(odom, Odometry, queue_size=10, tcp_nodelay=True))
        self._tf = self.own(rospy.Publisher("/tf", TFMessage, queue_size=10, tcp_nodelay=True)) if tf else None

    def most_steps(self, world: World) -> int | None:
        """A few steps while the speed changes."""
        return max(1, round(_RENEWED / world.timestep)) if self._driver.is_changing else None

    def before(self, world: World, steps: int) -> None:
        """Set the wheels' targets."""
        self._driver.command(world, steps)

    def where(self) -> tuple[Place, Motion]:
        """Return the pose and the velocity for the odometry: those from the wheels."""
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
    """Return a nav_msgs/Odometry, and the same pose as a geometry_msgs/TransformStamped."""
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
