"""Controller whose actions are the linear and angular velocities of a wheeled base."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller, JointGroup, Snapshot
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.errors import UnsuitableRobotError
from frobs_core.util.validation import positive

_OWNER = "differential_drive"


class DifferentialDrive(Controller):
    """Controller that converts forward and left-turn actions, each in [−1, 1], into wheel velocities.

    All other joints stay at rest. If a wheel would exceed its velocity limit, all wheels are slowed down by the same
    factor, so that the robot follows the same curve more slowly.

    Args:
        max_linear_velocity: Linear velocity [m/s] for an action of 1, or None to use the robot's maximum linear
            velocity.
        max_angular_velocity: Angular velocity [rad/s] for an action of 1, or None to use the robot's maximum angular
            velocity.
        max_linear_acceleration: Maximum linear acceleration [m/s²], or None to use the robot's limit (if any).
        max_angular_acceleration: Maximum angular acceleration [rad/s²], or None to use the robot's limit (if any).
    """

    command_mode = CommandMode.VELOCITY
    axes: tuple[str, ...] = ("linear", "angular")

    def __init__(
        self,
        *,
        max_linear_velocity: float | None = None,
        max_angular_velocity: float | None = None,
        max_linear_acceleration: float | None = None,
        max_angular_acceleration: float | None = None,
    ) -> None:
        def checked(name: str, value: float | None, unit: str) -> float | None:
            return None if value is None else positive(f"{_OWNER}: {name}", value, unit)

        self.max_linear_velocity = checked("max_linear_velocity", max_linear_velocity, "m/s")
        self.max_angular_velocity = checked("max_angular_velocity", max_angular_velocity, "rad/s")
        self.max_linear_acceleration = checked("max_linear_acceleration", max_linear_acceleration, "m/s²")
        self.max_angular_acceleration = checked("max_angular_acceleration", max_angular_acceleration, "rad/s²")

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints.

        Raises:
            ConfigurationError: The robot's differential drive is missing or invalid.
        """
        drive = joints.robot.differential_drive
        if drive is None:
            raise UnsuitableRobotError(
                joints.robot.name,
                "has no differential drive; set differential_drive=DifferentialDrive(…) in its Robot, or choose "
                "another controller.",
                _OWNER,
            )
        radius = positive(f"{_OWNER}: the robot's wheel_radius", drive.wheel_radius, "m")
        separation = positive(f"{_OWNER}: the robot's separation", drive.separation, "m")
        linear = self.max_linear_velocity or positive(
            f"{_OWNER}: the robot's max_linear_velocity", drive.max_linear_velocity, "m/s"
        )
        angular = self.max_angular_velocity or positive(
            f"{_OWNER}: the robot's max_angular_velocity", drive.max_angular_velocity, "rad/s"
        )
        shape = (joints.num_envs, joints.dof)
        self._per_linear, self._per_angular = np.zeros(shape), np.zeros(shape)  # wheel velocity per base velocity
        for side, wheels in ((-1.0, drive.left), (1.0, drive.right)):
            if not wheels:
                raise UnsuitableRobotError(
                    joints.robot.name,
                    "has no wheels on one side; both sides of a differential drive require wheels.",
                    _OWNER,
                )
            for joint in wheels:
                if joint not in joints.joint_names:
                    raise UnsuitableRobotError(
                        joints.robot.name,
                        f"has no actuated joint '{joint}' for a wheel; actuated joints: "
                        f"{', '.join(joints.joint_names)}.",
                        _OWNER,
                    )
                column = joints.joint_names.index(joint)
                self._per_linear[:, column] = 1.0 / radius
                self._per_angular[:, column] = side * 0.5 * separation / radius
        fastest = np.abs(self._per_linear) * linear + np.abs(self._per_angular) * angular  # (num_envs, dof) [rad/s]
        self._wheel_limit = joints.velocity_limit.copy()
        self._wheels_may_saturate = bool((fastest > self._wheel_limit).any())

        pair = (joints.num_envs, 2)
        acceleration = (
            self._acceleration("linear", drive.max_linear_acceleration, "m/s²"),
            self._acceleration("angular", drive.max_angular_acceleration, "rad/s²"),
        )
        self._scale = np.broadcast_to((linear, angular), pair).copy()
        self._ones = np.ones(pair)
        self._up = np.broadcast_to(np.multiply(acceleration, control_timestep), pair).copy()
        self._velocity, self._wanted, self._bound = np.zeros(pair), np.zeros(pair), np.zeros(pair)
        self._wheels, self._turning = np.zeros(shape), np.zeros(shape)
        self._minus_ones, self._down = -self._ones, -self._up
        self._joints = joints.joint_names
        self.action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def _acceleration(self, which: str, of_the_robot: float | None, unit: str) -> float:
        """Return the configured acceleration limit, or else the robot's limit, or infinity if neither is set."""
        given: float | None = getattr(self, f"max_{which}_acceleration")
        if given is not None:
            return given
        if of_the_robot is None:
            return float("inf")
        return positive(f"{_OWNER}: the robot's max_{which}_acceleration", of_the_robot, unit)

    def reset(self, mask: Mask | None) -> None:
        """Set the commanded base velocity to zero."""
        self._velocity[rows_of(mask)] = 0.0

    def apply(self, action: Action) -> Floats:
        """Return joint velocities, (num_envs, dof) [rad/s]."""
        velocity, requested, bound = self._velocity, self._wanted, self._bound  # (num_envs, 2) [m/s, rad/s]
        np.maximum(action, self._minus_ones, out=requested)
        np.minimum(requested, self._ones, out=requested)
        np.multiply(requested, self._scale, out=requested)
        np.add(velocity, self._up, out=bound)
        np.minimum(requested, bound, out=requested)
        np.add(velocity, self._down, out=bound)
        np.maximum(requested, bound, out=velocity)

        wheels = self._wheels
        np.multiply(velocity[:, 0:1], self._per_linear, out=wheels)
        np.multiply(velocity[:, 1:2], self._per_angular, out=self._turning)
        np.add(wheels, self._turning, out=wheels)
        if self._wheels_may_saturate:
            excess = np.maximum.reduce(np.abs(wheels) / self._wheel_limit, axis=-1, keepdims=True, initial=1.0)
            np.divide(wheels, excess, out=wheels)
        return wheels

    def law(self) -> Mapping[str, Any]:
        """Return the numbers of the law: base velocity = action · max_velocity, changed by at most max_change per step.

        Both have a linear [m/s] and an angular component [rad/s].
        """
        return {
            "law": _OWNER,
            "joints": list(self._joints),
            "max_velocity": self._scale[0].tolist(),
            "max_change": self._up[0].tolist(),
        }

    def stored_arrays(self) -> Snapshot:
        """Return the commanded base velocities."""
        return {"velocity": self._velocity}
