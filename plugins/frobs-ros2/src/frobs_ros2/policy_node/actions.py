"""Converts the actions of a policy into commands, as the controllers in training do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]

POSITION, VELOCITY, EFFORT = "position", "velocity", "effort"

CONTROLLERS = {
    "joint_delta_position": POSITION,
    "joint_position": POSITION,
    "joint_velocity": VELOCITY,
    "joint_effort": EFFORT,
    "differential_drive": VELOCITY,
}
"""Controllers whose actions can be converted, and the mode of their commands."""


class Actions:
    """Converts actions into joint commands, or into a linear and an angular velocity for ``differential_drive``.

    Args:
        name: Name of the controller.
        parameters: Parameters of the controller in training.
        lower: Lower position limits, (dof,) [rad or m].
        upper: Upper position limits, (dof,) [rad or m].
        velocity: Velocity limits, (dof,) [rad/s or m/s].
        effort: Effort limits, (dof,) [N·m or N].
        timestep: Time between two actions [s].

    Attributes:
        mode: Mode of the commands.
    """

    def __init__(
        self,
        name: str,
        parameters: Mapping[str, Any],
        lower: Array,
        upper: Array,
        velocity: Array,
        effort: Array,
        timestep: float,
    ) -> None:
        self.name, self.mode = name, CONTROLLERS[name]
        self._lower, self._upper, self._timestep = lower, upper, timestep
        self._velocity, self._effort = velocity, effort
        self._parameters = dict(parameters)
        self._target: Array = np.zeros(len(lower))
        if name == "joint_velocity" and self._parameters.get("max_velocity") is not None:
            self._velocity = np.minimum(velocity, float(self._parameters["max_velocity"]))
        if name == "joint_effort" and self._parameters.get("max_effort") is not None:
            self._effort = np.minimum(effort, float(self._parameters["max_effort"]))

    def reset(self, positions: Array) -> None:
        """Begin an episode at the measured positions, (dof,) [rad or m]."""
        self._target = np.array(positions, float)

    def sent(self, command: Array) -> None:
        """Continue from the command that was sent, if safety rules have changed it."""
        if self.mode == POSITION:
            self._target = np.array(command, float)

    def convert(self, action: Array, positions: Array) -> Array:
        """Return the command for an action.

        Args:
            action: Action in [−1, 1].
            positions: Measured positions, (dof,) [rad or m].
        """
        action = np.clip(np.asarray(action, float), -1.0, 1.0)
        if self.mode == POSITION:
            self._target = np.clip(self._next_target(action, positions), self._lower, self._upper)
            return np.array(self._target)
        if self.name == "joint_velocity":
            velocity = np.minimum(action * self._velocity, (self._upper - positions) / self._timestep)
            velocity = np.maximum(velocity, (self._lower - positions) / self._timestep)
            return np.asarray(np.clip(velocity, -self._velocity, self._velocity))
        if self.name == "joint_effort":
            return np.asarray(action * self._effort)
        scale = [self._parameters["max_linear_velocity"], self._parameters["max_angular_velocity"]]
        return np.asarray(action * np.array(scale, float))

    def _next_target(self, action: Array, positions: Array) -> Array:
        fastest = self._velocity * self._timestep
        if self.name == "joint_delta_position" and not self._parameters.get("full_range"):
            return np.asarray(self._target + action * np.minimum(float(self._parameters["max_delta"]), fastest))
        middle, half = self._range()
        if self.name == "joint_delta_position":
            return np.asarray(positions + middle + action * half)
        return np.asarray(self._target + np.clip(action * half + middle - self._target, -fastest, fastest))

    def _range(self) -> tuple[Array, Array]:
        lower = np.where(np.isfinite(self._lower), self._lower, -math.pi)
        upper = np.where(np.isfinite(self._upper), self._upper, math.pi)
        return 0.5 * (lower + upper), 0.5 * (upper - lower)
