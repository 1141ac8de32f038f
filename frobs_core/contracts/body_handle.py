"""The handle of a scene body in a simulation."""

from __future__ import annotations

from abc import ABC, abstractmethod

from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import CapabilityError


class BodyHandle(ABC):
    """Handle of a scene body in all environments."""

    name: str

    @property
    @abstractmethod
    def pose(self) -> tuple[Floats, Floats]:
        """Pose in the world frame: pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4)."""

    @property
    @abstractmethod
    def twist(self) -> tuple[Floats, Floats]:
        """Velocity: lin_vel_world (num_envs, 3) [m/s] of the body's origin and ang_vel_world (num_envs, 3) [rad/s]."""

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        """Teleport the body and set its velocity to 0.

        Args:
            pos: Position of the body's origin in the world frame, (n, 3) [m].
            quat_wxyz: Orientation, (n, 4), or None to keep the current orientation.
            mask: The environments to change.

        Raises:
            CapabilityError: The simulator does not support ``teleport``.
            SimulationError: The body is static.
        """
        raise CapabilityError.lacking(self, "teleport")

    def write_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        """Set the velocity of a free body.

        Args:
            lin_vel_world: (n, 3) [m/s] of the body's origin.
            ang_vel_world: (n, 3) [rad/s]
            mask: The environments to change.

        Raises:
            CapabilityError: The simulator does not support ``teleport``.
            SimulationError: The body is static or kinematic.
        """
        raise CapabilityError.lacking(self, "teleport")
