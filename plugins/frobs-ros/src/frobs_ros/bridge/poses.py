"""Poses and velocities as pairs of arrays, with conversions from and to ROS messages."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from frobs_core.models import Pose
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.rotations import quat_conjugate, quat_multiply, quat_rotate
from frobs_ros.messages.types import find_type


class Place(NamedTuple):
    """A pose.

    Attributes:
        pos: (3,) [m]
        quat_wxyz: (4,)
    """

    pos: Floats
    quat_wxyz: Floats

    def after(self, outer: Place) -> Place:
        """Convert this pose from the frame ``outer`` to the frame in which ``outer`` is expressed."""
        return Place(outer.pos + quat_rotate(outer.quat_wxyz, self.pos), quat_multiply(outer.quat_wxyz, self.quat_wxyz))

    def seen_from(self, frame: Place) -> Place:
        """Return this pose relative to ``frame``. Both poses must be expressed in the same frame."""
        back = quat_conjugate(frame.quat_wxyz)
        return Place(quat_rotate(back, self.pos - frame.pos), quat_multiply(back, self.quat_wxyz))

    def to_pose(self) -> Pose:
        """Convert the pose to a :class:`~frobs_core.models.Pose`."""
        x, y, z = self.pos.tolist()
        w, i, j, k = self.quat_wxyz.tolist()
        return Pose((x, y, z), (w, i, j, k))


class Motion(NamedTuple):
    """A velocity.

    Attributes:
        linear: (3,) [m/s]
        angular: (3,) [rad/s]
    """

    linear: Floats
    angular: Floats

    def turned(self, quat_wxyz: Floats) -> Motion:
        """Return the velocity rotated by a quaternion."""
        return Motion(quat_rotate(quat_wxyz, self.linear), quat_rotate(quat_wxyz, self.angular))


WORLD = Place(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
REST = Motion(np.zeros(3), np.zeros(3))


def place_of(pose: Pose) -> Place:
    """Convert a :class:`~frobs_core.models.Pose` to arrays."""
    return Place(np.array(pose.pos, np.float64), np.array(pose.quat_wxyz, np.float64))


def read_pose(message: Any) -> Place:
    """Read a geometry_msgs/Pose, in which a zero quaternion (FRobs_RL's default) means no rotation.

    Raises:
        ConfigurationError: The message contains a number that is not finite.
    """
    p, q = message.position, message.orientation
    numbers = np.array([p.x, p.y, p.z, q.w, q.x, q.y, q.z], np.float64)
    if not np.isfinite(numbers).all():
        raise ConfigurationError("the pose contains NaN or infinity; all numbers must be finite.")
    length = math.sqrt(float(np.square(numbers[3:]).sum()))
    return Place(numbers[:3], numbers[3:] / length if length > 1e-9 else WORLD.quat_wxyz)


def read_twist(message: Any) -> Motion:
    """Read a geometry_msgs/Twist.

    Raises:
        ConfigurationError: The message contains a number that is not finite.
    """
    return Motion(read_vector(message.linear), read_vector(message.angular))


def read_state(state: Any, frame: Place, frame_motion: Motion) -> tuple[Place, Motion]:
    """Read a gazebo_msgs/ModelState or LinkState in ``frame`` and return its pose and velocity in the world frame."""
    relative = read_twist(state.twist).turned(frame.quat_wxyz)
    motion = Motion(relative.linear + frame_motion.linear, relative.angular + frame_motion.angular)
    return read_pose(state.pose).after(frame), motion


def pose_message(place: Place) -> Any:
    """Return a geometry_msgs/Pose."""
    message = find_type("geometry_msgs/Pose")()
    p, q = message.position, message.orientation
    p.x, p.y, p.z = place.pos.tolist()
    q.w, q.x, q.y, q.z = place.quat_wxyz.tolist()
    return message


def twist_message(motion: Motion) -> Any:
    """Return a geometry_msgs/Twist."""
    message = find_type("geometry_msgs/Twist")()
    message.linear.x, message.linear.y, message.linear.z = motion.linear.tolist()
    message.angular.x, message.angular.y, message.angular.z = motion.angular.tolist()
    return message


def read_vector(message: Any) -> Floats:
    """Read a geometry_msgs/Vector3 or Point.

    Raises:
        ConfigurationError: The message contains a number that is not finite.
    """
    numbers = np.array([message.x, message.y, message.z], np.float64)
    if not np.isfinite(numbers).all():
        raise ConfigurationError("the vector contains NaN or infinity; all numbers must be finite.")
    return numbers
