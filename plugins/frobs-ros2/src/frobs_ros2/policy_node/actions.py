"""Converts the actions of a policy into commands, as the controllers in training do."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from frobs_ros2.policy_node.kinematics import Chain, Kinematics, rotation_about

Array = np.ndarray[Any, Any]

POSITION, VELOCITY, EFFORT = "position", "velocity", "effort"

CONTROLLERS = {
    "joint_delta_position": POSITION,
    "joint_position": POSITION,
    "joint_velocity": VELOCITY,
    "joint_effort": EFFORT,
    "tcp_delta_position": POSITION,
    "tcp_delta_pose": POSITION,
    "differential_drive": VELOCITY,
}
"""Controllers whose actions can be converted, and the mode of their commands."""

TOOLS = ("tcp_delta_position", "tcp_delta_pose")
"""Controllers whose actions move the tool."""

GRIPPERS = ("gripper_position", "gripper_delta", "gripper_binary")
"""Controllers of grippers, which may be combined with a controller that commands positions."""


def parts_of(name: str, laws: Sequence[Mapping[str, Any]], joints: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield the controller and the joints of each part of an action.

    Args:
        name: Name of the main controller.
        laws: Laws of all controllers; see :class:`Actions`.
        joints: Joints of the robot.
    """
    gripping = [str(joint) for law in laws if law.get("law") in GRIPPERS for joint in law["joints"]]
    for law in laws or [{}]:
        if law.get("law") in GRIPPERS:
            yield str(law["law"]), list(law["joints"])
        else:
            yield name, [joint for joint in joints if joint not in gripping]


class Actions:
    """Converts actions into joint commands, or into a linear and an angular velocity for ``differential_drive``.

    Args:
        name: Name of the main controller.
        parameters: Parameters of this controller in training.
        laws: Laws of all controllers, in the order of the action, as the bundle or ``Controller.law`` describe them.
        joints: Names of the joints.
        limits: Lower and upper position limits [rad or m], velocity limits [rad/s or m/s] and effort limits
            [N·m or N], (4, dof).
        timestep: Time between two actions [s].
        kinematics: Kinematics of the robot, which :data:`TOOLS` require.

    Attributes:
        mode: Mode of the commands.
        fingers: Columns of the joints of a gripper.
    """

    def __init__(
        self,
        name: str,
        parameters: Mapping[str, Any],
        laws: Sequence[Mapping[str, Any]],
        joints: Sequence[str],
        limits: Array,
        timestep: float,
        kinematics: Kinematics | None = None,
    ) -> None:
        self.mode, self.fingers = CONTROLLERS[name], list[int]()
        self._parts: list[tuple[slice, Array, _Part]] = []
        start, size = 0, 2 if name == "differential_drive" else len(joints)
        self._command = np.zeros(size)
        for law, (controller, names) in zip(laws or [{}], parts_of(name, laws, joints), strict=True):
            columns = np.array([list(joints).index(joint) for joint in names], int)
            part: _Part
            if controller in GRIPPERS:
                part = _Gripper(law)
                self.fingers += columns.tolist()
            elif controller in TOOLS:
                assert kinematics is not None
                part = _Tool(law, kinematics.chain(str(law["frame"])), columns)
            elif controller == "differential_drive":
                part, columns = _Wheels(law), np.arange(2)
            else:
                part = _Joints(controller, parameters, limits[:, columns], timestep)
            self._parts.append((slice(start, start + part.width), columns, part))
            start += part.width
        self.width = start

    def reset(self, positions: Array) -> None:
        """Begin an episode at the measured positions, (dof,) [rad or m]."""
        for _, columns, part in self._parts:
            part.reset(positions, columns)

    def sent(self, command: Array) -> None:
        """Continue from the command that was sent, if safety rules have changed it."""
        for _, columns, part in self._parts:
            part.sent(command[columns])

    def convert(self, action: Array, positions: Array) -> Array:
        """Return the command for an action.

        Args:
            action: Action in [−1, 1].
            positions: Measured positions, (dof,) [rad or m].
        """
        action = np.clip(np.asarray(action, float), -1.0, 1.0)
        for own, columns, part in self._parts:
            self._command[columns] = part.convert(action[own], positions, columns)
        return self._command.copy()


class _Part(ABC):
    """A controller of some of the joints."""

    width: int

    def reset(self, positions: Array, columns: Array) -> None:
        """Begin at the measured positions of all joints."""

    def sent(self, command: Array) -> None:
        """Continue from the command of these joints that was sent."""

    @abstractmethod
    def convert(self, action: Array, positions: Array, columns: Array) -> Array:
        """Return the command of these joints for their part of the action and the positions of all joints."""


class _Joints(_Part):
    def __init__(self, name: str, parameters: Mapping[str, Any], limits: Array, timestep: float) -> None:
        lower, upper, velocity, effort = limits
        self.width, self._name, self._parameters = len(lower), name, parameters
        self._lower, self._upper, self._timestep = lower, upper, timestep
        self._velocity = np.minimum(velocity, _number(parameters.get("max_velocity"), math.inf))
        self._effort = np.minimum(effort, _number(parameters.get("max_effort"), math.inf))
        self._fastest = velocity * timestep
        low, high = (np.where(np.isfinite(a), a, b) for a, b in ((lower, -math.pi), (upper, math.pi)))
        self._middle, self._half = 0.5 * (low + high), 0.5 * (high - low)
        self._target: Array = np.zeros(len(lower))

    def reset(self, positions: Array, columns: Array) -> None:
        self._target = positions[columns]

    def sent(self, command: Array) -> None:
        self._target = command

    def convert(self, action: Array, positions: Array, columns: Array) -> Array:
        measured = positions[columns]
        if self._name == "joint_velocity":
            velocity = np.minimum(action * self._velocity, (self._upper - measured) / self._timestep)
            velocity = np.maximum(velocity, (self._lower - measured) / self._timestep)
            return np.asarray(np.clip(velocity, -self._velocity, self._velocity))
        if self._name == "joint_effort":
            return np.asarray(action * self._effort)
        self._target = np.clip(self._next(action, measured), self._lower, self._upper)
        return self._target

    def _next(self, action: Array, measured: Array) -> Array:
        if self._name == "joint_position":
            change = action * self._half + self._middle - self._target
            return np.asarray(self._target + np.clip(change, -self._fastest, self._fastest))
        if self._parameters.get("full_range"):
            return np.asarray(measured + self._middle + action * self._half)
        return np.asarray(self._target + action * np.minimum(float(self._parameters["max_delta"]), self._fastest))


class _Tool(_Part):
    """Damped least squares with a target point or pose, as ``frobs_controllers`` describes it."""

    def __init__(self, law: Mapping[str, Any], arm: Chain, columns: Array) -> None:
        self.width, self._arm = len(law["columns"]), arm
        self._axes, self._steps = list(law["columns"]), np.array(law["steps"], float)
        self._low, self._high = _bounds(law["target_low"], -math.inf), _bounds(law["target_high"], math.inf)
        self._lower, self._upper = _bounds(law["lower"], -math.inf), _bounds(law["upper"], math.inf)
        self._fastest = _bounds(law["max_change"], math.inf)
        self._home, self._gain = np.array(law["home"], float), np.array(law["posture_gain"], float)
        self._damping, self._free = float(law["damping"]) * np.eye(len(self._steps)), law.get("free_row")
        self._commanded = self._home

    def reset(self, positions: Array, columns: Array) -> None:
        self._commanded = positions[columns]
        tool = self._arm.frames(positions)[-1]
        self._target, self._rotation = tool[:3, 3].copy(), tool[:3, :3].copy()

    def sent(self, command: Array) -> None:
        self._commanded = command

    def convert(self, action: Array, positions: Array, columns: Array) -> Array:
        frames = self._arm.frames(positions)
        steps = self._steps
        rows = len(steps)  # 6, or 3 without rotations
        jacobian = self._arm.jacobian(frames)[:rows, columns]
        if self._free is not None:
            jacobian[self._free] = 0.0
        step = np.zeros(rows)
        step[self._axes] = action
        step *= steps
        inside = np.clip(self._target + step[:3], self._low, self._high)
        step[:3] = np.clip(inside - self._target, -steps[:3], steps[:3])
        turn = _between(frames[-1, :3, :3], self._rotation)
        left = np.concatenate([self._target - frames[-1, :3, 3], turn])[:rows]
        left -= jacobian @ (self._commanded - positions[columns])  # the command is ahead of the arm
        remainder = np.clip(left, -steps, steps)
        moved = remainder - left + step
        self._target += moved[:3]
        if (angle := float(np.linalg.norm(moved[3:]))) > 0.0:
            self._rotation = rotation_about(moved[3:] / angle, angle) @ self._rotation
        self._commanded = self._move(jacobian, remainder + step)
        return self._commanded

    def _move(self, jacobian: Array, error: Array) -> Array:
        before, posture = self._commanded, self._gain * (self._home - self._commanded)
        for is_last in (False, True):
            task = np.linalg.solve(jacobian @ jacobian.T + self._damping, error - jacobian @ posture)
            change = np.clip(posture + jacobian.T @ task, -self._fastest, self._fastest)
            after = np.clip(before + change, self._lower, self._upper)
            held = ((before <= self._lower) & (change < 0.0)) | ((before >= self._upper) & (change > 0.0))
            if is_last or not held.any():  # the other joints make up for those at their limits
                break
            jacobian, posture = jacobian * ~held, posture * ~held
        return np.asarray(after)


class _Gripper(_Part):
    width = 1

    def __init__(self, law: Mapping[str, Any]) -> None:
        self._law, self._step = law["law"], _number(law.get("max_delta"), 0.0)
        self._closed, self._stroke = np.array(law["closed"], float), np.array(law["stroke"], float)
        self._fastest = _bounds(law["max_change"], math.inf)

    def reset(self, positions: Array, columns: Array) -> None:
        self._opening = (positions[columns] - self._closed) / self._stroke
        self._wanted = float(np.clip(self._opening.mean(), 0.0, 1.0))

    def sent(self, command: Array) -> None:
        self._opening = (command - self._closed) / self._stroke

    def convert(self, action: Array, positions: Array, columns: Array) -> Array:
        (value,) = action.tolist()
        if self._law == "gripper_position":
            self._wanted = 0.5 * (value + 1.0)
        elif self._law == "gripper_delta":
            self._wanted = min(max(self._wanted + self._step * value, 0.0), 1.0)
        elif value:
            self._wanted = float(value > 0.0)
        self._opening = self._opening + np.clip(self._wanted - self._opening, -self._fastest, self._fastest)
        return np.asarray(self._closed + self._opening * self._stroke)


class _Wheels(_Part):
    width = 2

    def __init__(self, law: Mapping[str, Any]) -> None:
        self._fastest, self._change = np.array(law["max_velocity"], float), _bounds(law["max_change"], math.inf)
        self._velocity: Array = np.zeros(2)

    def reset(self, positions: Array, columns: Array) -> None:
        self._velocity = np.zeros(2)

    def sent(self, command: Array) -> None:
        self._velocity = command

    def convert(self, action: Array, positions: Array, columns: Array) -> Array:
        change = np.clip(action * self._fastest - self._velocity, -self._change, self._change)
        self._velocity = self._velocity + change
        return self._velocity


def _number(value: Any, missing: float) -> float:
    return missing if value is None else float(value)


def _bounds(values: Sequence[Any], missing: float) -> Array:
    """Return limits as an array; bundles store None for infinity."""
    return np.array([_number(value, missing) for value in values])


def _between(start: Array, end: Array) -> Array:
    """Return 2 sin(angle / 2) times the axis of the rotation from one rotation matrix to another, (3,)."""
    turn = end @ start.T
    vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.asarray(vector / math.sqrt(max(0.25 * (1.0 + float(np.trace(turn))), 1e-12)))
