"""State of an object, which is read once per step, and observation terms that are clipped to their bounds."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from frobs_core.contracts import BodyHandle
from frobs_core.description import ObservationTerm
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat

_NEAR = 0.03
"""Maximum absolute value of the terms for small offsets [m]."""


def bounded(
    values: Floats, limit: float, unit: str, scale: float = 1.0, *, proprioceptive: bool = False
) -> ObservationTerm:
    """Return an observation term whose values are clipped to [−``limit``, ``limit``].

    Args:
        values: Array (num_envs, k) to which the task writes the current values at each step.
        limit: Maximum absolute value of the term.
        unit: Unit of the values.
        scale: Suggested factor by which a learner scales the values.
        proprioceptive: Whether the robot itself can measure the values.
    """
    high = np.full(values.shape[1], limit)
    return ObservationTerm(
        read=partial(values.clip, -limit, limit),
        low=-high,
        high=high,
        unit=unit,
        scale=scale,
        proprioceptive=proprioceptive,
    )


def near(offset: Floats) -> ObservationTerm:
    """Return an observation term for small offsets (num_envs, k) [m], clipped to 3 cm along each axis.

    Learners scale each observation by its typical size. Without such terms, they hardly distinguish offsets of a few
    millimeters.
    """
    return bounded(offset, _NEAR, "m", scale=1.0 / _NEAR)


class Tracked:
    """State of a free body in the scene. The arrays are updated in place.

    Attributes:
        body: Handle of the body.
        pos: Position in the world frame, (num_envs, 3) [m].
        quat_wxyz: Orientation in the world frame, scalar first, (num_envs, 4).
        axes: The object's x and y axes in the world frame, (num_envs, 6).
        velocity: Linear velocity in the world frame, (num_envs, 3) [m/s].
        angular_velocity: Angular velocity in the world frame, (num_envs, 3) [rad/s].
    """

    def __init__(self, body: BodyHandle) -> None:
        self.body = body
        (self.pos, self.quat_wxyz), (self.velocity, self.angular_velocity) = (
            tuple(map(np.array, values)) for values in (body.pose, body.twist)
        )
        self.axes = np.zeros((len(self.pos), 6))
        self.read()

    def read(self) -> None:
        """Read the current state of the body."""
        self.pos[:], self.quat_wxyz[:] = self.body.pose
        self.velocity[:], self.angular_velocity[:] = self.body.twist
        matrix = matrix_from_quat(self.quat_wxyz)
        self.axes[:, :3], self.axes[:, 3:] = matrix[:, :, 0], matrix[:, :, 1]

    def terms(self, name: str) -> dict[str, ObservationTerm]:
        """Return observation terms for the position, the orientation, and the linear and angular velocities.

        The orientation is represented by the object's x and y axes in the world frame. These six numbers are a
        continuous and unique representation.

        Args:
            name: Name of the object, used as a prefix of the term names.
        """
        return {
            f"{name}_position": bounded(self.pos, 2.0, "m", scale=4.0),
            f"{name}_orientation": bounded(self.axes, 1.0, "1"),
            f"{name}_velocity": bounded(self.velocity, 5.0, "m/s"),
            f"{name}_angular_velocity": bounded(self.angular_velocity, 50.0, "rad/s", scale=0.1),
        }


def near_terms(task: Any) -> dict[str, ObservationTerm]:
    """Return the observation terms for small offsets object − tool and goal − object of an ``ObjectTask``."""
    return {f"{task.body_name}_offset_near": near(task._offset), "goal_offset_near": near(task._goal_offset)}
