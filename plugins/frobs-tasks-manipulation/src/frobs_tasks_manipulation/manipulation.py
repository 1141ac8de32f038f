"""Base class of all manipulation tasks, in which an arm with a gripper works above an area of the floor."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Control, RobotHandle, Simulation, Snapshot, StepContext, Task
from frobs_core.description import Camera, EndEffector, ObservationTerm
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ResetOptionError, UnsuitableRobotError
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import quat_from_axis_angle, quat_multiply
from frobs_core.util.validation import number_list, numbers, positive, whole_number
from frobs_tasks_manipulation.observed import bounded
from frobs_tasks_manipulation.posture import posture_at

DOWN = (0.0, 1.0, 0.0, 0.0)
"""Orientation (w, x, y, z) of a tool that points down and whose fingers close along the world's y axis."""

UP: Floats = np.array([0.0, 0.0, 1.0])

FLOOR_FRICTION = 0.5
"""Friction coefficient of the floor. With a coefficient of 1, a pushed cube would jam between the tool and the
floor."""

_TURN = np.pi / 12
"""Maximum initial rotation of objects about the vertical axis [rad]."""

_CANDIDATES = 16
"""Number of candidate positions drawn at once. The first position that is far enough from the other object is used."""


class Manipulation(Task):
    """Base class of the manipulation tasks.

    At the start of an episode, the tool is above the center of the working area and points down. Episodes never
    terminate. An episode is successful if, at the time limit, the task's success condition has been met for the last
    ``hold_steps`` control steps.

    Args:
        center: Center (x, y) of the working area on the floor, in the world frame [m].
        area: Side length of the square working area in which objects and goals are placed [m].
        start_height: Height of the tool above the floor at the start of an episode [m].
        hold_steps: Number of control steps for which the success condition must be met.

    Attributes:
        start_opening: Opening of the gripper at the start of an episode, from 0 (closed) to 1 (open).
        finger_axis: World axis along which the fingers close: ``"x"`` or ``"y"``.
        gripper: The robot's gripper, set by ``bind``.

    Raises:
        ConfigurationError: A value is out of range.
    """

    reward_types: ClassVar[Sequence[str]] = ("dense", "sparse")
    reset_options: ClassVar[Sequence[str]] = ()
    robots: ClassVar[Sequence[str]] = ("robot",)
    control_timestep: ClassVar[float] = 0.04
    physics_timestep: ClassVar[float] = 0.004
    start_opening: ClassVar[float] = 1.0
    finger_axis: ClassVar[str] = "y"
    gripper: EndEffector

    def __init__(
        self,
        *,
        center: Sequence[float] = (0.5, 0.0),
        area: float = 0.3,
        start_height: float = 0.15,
        hold_steps: int = 5,
    ) -> None:
        self.center = np.array(number_list("center", center, 2))
        self.area = positive("area", area, "m")
        self.start_height = positive("start_height", start_height, "m")
        self.hold_steps = whole_number("hold_steps", hold_steps, 1)
        self.reward_type = self.reward_types[0]

    def reset_needs(self, options: Collection[str] = ()) -> Mapping[str, Level]:
        """Return the capability ``teleport``, because each reset places the arm and the objects."""
        return {"teleport": Level.APPROXIMATE}

    def cameras(self) -> dict[str, Camera]:
        """Return a camera that views the working area from the front right."""
        x, y = self.center.tolist()
        return {"overview": Camera(pos=(x + 0.75, y - 0.75, 0.65), target=(x - 0.1, y, 0.12), fov_y=42.0)}

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Bind the task to a simulation.

        Raises:
            UnsuitableRobotError: The robot has no gripper, or its tool cannot reach the working area.
        """
        self._simulation = simulation
        self._robot: RobotHandle = control.robot("robot")
        self.num_envs = self._robot.num_envs
        tool = self._robot.end_effector
        if tool is None or not tool.is_gripper:
            raise UnsuitableRobotError(
                self._robot.robot.name,
                "has no gripper; attach one with Robot.attach, or choose a robot such as 'panda'.",
            )
        self.gripper = tool
        names = self._robot.joint_names
        self._fingers = [names.index(joint) for joint in tool.closed]
        self._closed = np.array([tool.closed[joint] for joint in tool.closed])
        self._stroke = np.array([tool.open[joint] for joint in tool.closed]) - self._closed
        self._start = posture_at(self._robot, np.array([*self.center, self.start_height]), self._tool_quat())
        self._start[self._fingers] = self._closed + self.start_opening * self._stroke
        self._held = np.zeros(self.num_envs, np.int64)
        self._reward_terms: dict[str, Floats] = {}
        self._bind_objects()

    def _tool_quat(self) -> Floats:
        """Return the orientation of the tool at the start of an episode, (4,)."""
        half = np.sqrt(0.5)
        return np.array(DOWN) if self.finger_axis == "y" else quat_multiply((half, 0.0, 0.0, half), DOWN)

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Place the arm, the objects and the goal.

        Args:
            mask: The environments to reset.
            rng: Source of all random numbers.
            options: Values of those ``reset_options`` that the caller passed, (num_envs, 3) [m] each.

        Raises:
            ResetOptionError: A position does not consist of three numbers, is below the floor, or is too far from the
                working area.
        """
        rows = rows_of(mask)
        self._robot.write_joint_state(np.tile(self._start, (len(self._held[rows]), 1)), mask=mask)
        self._place_objects(mask, rng, {name: values[rows] for name, values in options.items()})
        self._held[rows] = 0
        self._measure()

    def advance(self, context: StepContext) -> None:
        """Measure the states of the tool and the objects, and count the steps in which the success condition is met."""
        self._measure()
        np.add(self._held, 1, out=self._held)
        np.multiply(self._held, self._is_achieved(), out=self._held)

    def is_success(self) -> Mask:
        """Return whether the success condition has been met for ``hold_steps`` steps, (num_envs,) bool."""
        return self._held >= self.hold_steps

    def reward_terms(self) -> Mapping[str, Floats]:
        """Return the terms whose sum is the last reward, (num_envs,) each."""
        return self._reward_terms

    def reward(self, context: StepContext) -> Floats:
        """Return the reward of each environment, (num_envs,)."""
        if self.reward_type == "sparse":
            self._reward_terms = {"unachieved": np.where(self._is_achieved(), 0.0, -1.0)}
        else:
            self._reward_terms = dict(self._dense_terms())
        total, *others = self._reward_terms.values()
        for term in others:
            total = total + term
        return total

    def tool_terms(self) -> dict[str, ObservationTerm]:
        """Return the observation terms for the tool: position [m], linear velocity [m/s] and gripper opening."""
        return {
            "tcp_position": bounded(lambda: self.tcp, 3, 2.0, "m", scale=4.0, proprioceptive=True),
            "tcp_velocity": bounded(lambda: self.tcp_velocity, 3, 5.0, "m/s", proprioceptive=True),
            "gripper_opening": bounded(lambda: self.opening[:, None], 1, 1.5, "1", proprioceptive=True),
        }

    def stored_arrays(self) -> Snapshot:
        """Return the number of steps for which the success condition has been met."""
        return {"held": self._held}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        super().restore(snapshot)
        self._measure()

    def _measure(self) -> None:
        """Read the values that the observation, the reward and the success condition use."""
        self.tcp = self._robot.frame_pose("tcp")[0]  # (num_envs, 3) [m]
        self.tcp_velocity = self._robot.frame_velocity("tcp")[0]  # (num_envs, 3) [m/s]
        fingers = (self._robot.joint_positions[:, self._fingers] - self._closed) / self._stroke
        self.opening = fingers.sum(axis=1) / len(self._fingers)  # (num_envs,): 0 is closed, 1 is open

    # -- Methods that tasks define --

    @abstractmethod
    def _bind_objects(self) -> None:
        """Store the handles of the objects, and allocate a buffer for the goal."""

    @abstractmethod
    def _place_objects(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Floats]) -> None:
        """Place the objects and the goal at the positions in the options, (n, 3) each, or at random positions."""

    @abstractmethod
    def _is_achieved(self) -> Mask:
        """Return whether the success condition is currently met, (num_envs,) bool."""

    @abstractmethod
    def _dense_terms(self) -> Mapping[str, Floats]:
        """Return the terms of the dense reward, (num_envs,) each."""

    # -- Helpers --

    def draw_place(
        self,
        stream: str,
        rng: RandomSource,
        mask: Mask | None,
        *,
        height: float,
        apart_from: Floats | None = None,
        distance: float = 0.0,
    ) -> Floats:
        """Draw positions uniformly from the working area.

        Args:
            stream: Name of the random stream.
            rng: Source of the random numbers.
            mask: The n environments for which to draw.
            height: Height of the positions [m].
            apart_from: Positions (n, 3) [m] to which the drawn positions must keep a minimum horizontal distance, or
                None.
            distance: Minimum horizontal distance from ``apart_from`` [m]. If no candidate is that far away, the
                farthest candidate is used.

        Returns:
            The positions in the world frame, (n, 3) [m].
        """
        half = self.area / 2
        candidates = rng.uniform(stream, -half, half, (_CANDIDATES, 2), mask) + self.center  # (n, candidates, 2)
        if apart_from is None:
            chosen = candidates[:, 0]
        else:
            offset = candidates - apart_from[:, None, :2]
            away = np.sqrt((offset * offset).sum(axis=2))
            ranks = np.where(away >= distance, np.arange(_CANDIDATES, 0, -1) + 10.0, away)
            chosen = candidates[np.arange(len(candidates)), ranks.argmax(axis=1)]
        return np.concatenate([chosen, np.full((len(chosen), 1), height)], axis=1)

    def checked_place(self, option: str, place: Floats, lowest: float) -> Floats:
        """Validate and return positions (n, 3) [m] that were passed to ``reset``.

        Args:
            option: Name of the reset option, used in error messages.
            place: Positions in the world frame, (n, 3) [m].
            lowest: Minimum height of the positions [m].

        Raises:
            ResetOptionError: A position does not consist of three numbers, is below ``lowest``, or is more than 1 m
                from the center of the working area.
        """
        if place.shape[1:] != (3,):
            raise ResetOptionError(option, f"has the shape {place.shape[1:]}; it must be (3,): x, y, z [m].")
        low = place[:, 2] < lowest - 1e-9
        if low.any():
            raise ResetOptionError(option, f"is {numbers(place[low][0])} m; its height must be at least {lowest:g} m.")
        far = np.any(np.abs(place[:, :2] - self.center) > 1.0, axis=1)
        if far.any():
            center = numbers(self.center)
            raise ResetOptionError(
                option, f"is {numbers(place[far][0])} m; it must be within 1 m of the center {center} m along x and y."
            )
        return place

    def draw_turn(self, stream: str, rng: RandomSource, mask: Mask | None) -> Floats:
        """Draw orientations (n, 4) of an object on the floor, rotated only so far that the fingers still fit.

        Args:
            stream: Name of the random stream.
            rng: Source of the random numbers.
            mask: The n environments for which to draw.
        """
        return quat_from_axis_angle(UP, rng.uniform(stream, -_TURN, _TURN, (), mask))
