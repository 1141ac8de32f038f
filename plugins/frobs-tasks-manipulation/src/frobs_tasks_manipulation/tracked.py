"""State of an object, which is read once per step."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import BodyHandle
from frobs_core.description import ObservationTerm
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat
from frobs_tasks_manipulation.observed import bounded


class Tracked:
    """State of a free body in the scene.

    Attributes:
        body: Handle of the body.
        pos: Position in the world frame, (num_envs, 3) [m].
        quat_wxyz: Orientation in the world frame, scalar first, (num_envs, 4).
        velocity: Linear velocity in the world frame, (num_envs, 3) [m/s].
        angular_velocity: Angular velocity in the world frame, (num_envs, 3) [rad/s].
    """

    def __init__(self, body: BodyHandle) -> None:
        self.body = body
        self.read()

    def read(self) -> None:
        """Read the current state of the body."""
        self.pos, self.quat_wxyz = self.body.pose
        self.velocity, self.angular_velocity = self.body.twist

    def terms(self, name: str) -> dict[str, ObservationTerm]:
        """Return observation terms for the position, the orientation, and the linear and angular velocities.

        The orientation is represented by the object's x and y axes in the world frame. These six numbers are a
        continuous and unique representation.

        Args:
            name: Name of the object, used as a prefix of the term names.
        """
        return {
            f"{name}_position": bounded(lambda: self.pos, 3, 2.0, "m", scale=4.0),
            f"{name}_orientation": bounded(self._axes, 6, 1.0, "1"),
            f"{name}_velocity": bounded(lambda: self.velocity, 3, 5.0, "m/s"),
            f"{name}_angular_velocity": bounded(lambda: self.angular_velocity, 3, 50.0, "rad/s", scale=0.1),
        }

    def _axes(self) -> Floats:
        matrix = matrix_from_quat(self.quat_wxyz)
        return np.concatenate([matrix[:, :, 0], matrix[:, :, 1]], axis=1)
