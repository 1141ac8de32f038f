"""Differential drives, which convert velocity commands to wheel speeds, and compute odometry from wheel angles."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.description import DifferentialDrive
from frobs_core.models import BANDWIDTH
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import REST, Motion, Place, pose_message, twist_message
from frobs_ros.bridge.world import NANO, World
from frobs_ros.messages.types import find_type

_RENEWED = 0.005  # time [s] between two commands while the speed is changing


@dataclass(frozen=True, kw_only=True)
class DriveSettings:
    """Settings of a differential drive.

    Attributes:
        wheels: Wheels and limits. A limit may be infinite.
        command: Topic of the velocity commands.
        odom: Topic of the odometry.
        frame: Frame of the odometry.
        child: Frame of the base.
        tf: Whether the odometry is also published as a transform.
        timeout: Time without a new command after which the base stops [s], or inf for no timeout.
        stiff: Whether to increase the wheels' drive gains to account for the robot's mass.
    """

    wheels: DifferentialDrive
    command: str
    odom: str
    frame: str
    child: str
    tf: bool = True
    timeout: float = math.inf
    stiff: bool = True


class Driving(Component):
    """Component that follows the latest twist, and publishes the odometry of the base."""

    def connect(self, model: Model, settings: DriveSettings) -> None:
        """Create the subscriber and the publishers. Constructors must call this method last."""
        wheels = settings.wheels
        self._model, self._settings = model, settings
        self._left, self._right = ([model.joints[name] for name in side] for side in (wheels.left, wheels.right))
        accelerations = wheels.max_linear_acceleration, wheels.max_angular_acceleration
        self._accelerations = [math.inf if limit is None else limit for limit in accelerations]
        self._new: tuple[float, float] | None = None
        self.subscribe(settings.command, "geometry_msgs/Twist", self._take)
        self._odom = self.publisher(settings.odom, "nav_msgs/Odometry", queue_size=10)
        self._tf = self.publisher("/tf", "tf2_msgs/TFMessage", queue_size=10) if settings.tf else None

    def _take(self, twist: Any) -> None:
        """Store a received geometry_msgs/Twist. Called in a rospy thread."""
        linear, angular = float(twist.linear.x), float(twist.angular.z)
        if math.isfinite(linear) and math.isfinite(angular):
            self._new = linear, angular

    def begin(self, world: World) -> None:
        """Stop the base and use its current pose as the odometry origin."""
        if self._settings.stiff:
            self._stiffen(world)
        self._new, self._wanted, self._present = None, (0.0, 0.0), (0.0, 0.0)
        self._since = 0.0
        self._turned = self._angles()
        self._x = self._y = self._yaw = 0.0
        self._motion = REST
        self._last_ns = world.time_ns

    def before(self, world: World, steps: int) -> None:
        wheels, now, span = self._settings.wheels, world.time_ns / NANO, steps * world.timestep
        new, self._new = self._new, None
        if new is not None:
            self._wanted, self._since = new, now
        elif now - self._since > self._settings.timeout:
            self._wanted = 0.0, 0.0
        speeds = wheels.max_linear_velocity, wheels.max_angular_velocity
        linear, angular = (
            present + _clipped(_clipped(requested, most) - present, change * span)
            for present, requested, most, change in zip(
                self._present, self._wanted, speeds, self._accelerations, strict=True
            )
        )
        self._present = linear, angular
        targets = self._model.joint_targets.targets
        targets[self._left] = (linear - angular * wheels.separation / 2.0) / wheels.wheel_radius
        targets[self._right] = (linear + angular * wheels.separation / 2.0) / wheels.wheel_radius

    def most_steps(self, world: World) -> int | None:
        """Return a small number of steps while the speed is changing under an acceleration limit, and None otherwise."""
        if any(map(math.isfinite, self._accelerations)) and (self._present != self._wanted or self._new is not None):
            return max(1, round(_RENEWED / world.timestep))
        return None

    def where(self) -> tuple[Place, Motion]:
        """Return the odometry's pose, relative to the start pose, and velocity, computed from the wheels' rotation."""
        quat = np.array([math.cos(self._yaw / 2.0), 0.0, 0.0, math.sin(self._yaw / 2.0)])
        return Place(np.array([self._x, self._y, 0.0]), quat), self._motion

    def tell(self, world: World) -> None:
        span, self._last_ns = (world.time_ns - self._last_ns) / NANO, world.time_ns
        if span <= 0.0:
            return
        self._reckon(span)
        odom, transform = odometry(self.header(world, self._settings.frame), self._settings.child, *self.where())
        self._odom.publish(odom)
        if self._tf is not None:
            self._tf.publish([transform])

    def _reckon(self, span: float) -> None:
        """Update the odometry from the wheels' rotation during the last ``span`` [s]."""
        wheels, before = self._settings.wheels, self._turned
        self._turned = self._angles()
        left, right = ((now - then) * wheels.wheel_radius for now, then in zip(self._turned, before, strict=True))
        ahead, turn = 0.5 * (left + right), (right - left) / wheels.separation
        middle = self._yaw + 0.5 * turn
        self._x += ahead * math.cos(middle)
        self._y += ahead * math.sin(middle)
        self._yaw += turn
        self._motion = Motion(np.array([ahead / span, 0.0, 0.0]), np.array([0.0, 0.0, turn / span]))

    def _stiffen(self, world: World) -> None:
        """Increase the wheels' drive gains to account for the robot's mass, using the default drive bandwidth.

        By default, a joint's gains account only for the links that it carries, but wheels must move the whole robot.
        """
        robot, links = self._model.handle, self._model.placement().model.links
        mass = sum(link.inertial.mass for link in links if link.inertial is not None)
        columns = [*self._left, *self._right]
        damping = robot.drive_gains()[1].copy()
        least = 2.0 * (2.0 * math.pi * BANDWIDTH) * mass * self._settings.wheels.wheel_radius**2 / len(columns)
        if (damping[0, columns] < least).any():
            damping[0, columns] = np.maximum(damping[0, columns], least)
            world.write_parameter("damping", self._model.key, damping)

    def _angles(self) -> tuple[float, float]:
        angles = self._model.handle.joint_positions[0]
        return float(angles[self._left].mean()), float(angles[self._right].mean())


def _clipped(value: float, most: float) -> float:
    return max(-most, min(most, value))


def odometry(header: Any, child: str, place: Place, motion: Motion) -> tuple[Any, Any]:
    """Return a nav_msgs/Odometry message and a geometry_msgs/TransformStamped message with the same pose."""
    odom = find_type("nav_msgs/Odometry")(header=header, child_frame_id=child)
    odom.pose.pose, odom.twist.twist = pose_message(place), twist_message(motion)
    transform = find_type("geometry_msgs/TransformStamped")(header=copy(header), child_frame_id=child)
    at, turn = transform.transform.translation, transform.transform.rotation
    at.x, at.y, at.z = place.pos.tolist()
    turn.w, turn.x, turn.y, turn.z = place.quat_wxyz.tolist()
    return odom, transform
