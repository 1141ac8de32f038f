"""Reaching task: hold the tool center point at a fixed goal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, TypeVar

import numpy as np

from frobs_core.contracts import Control, RobotHandle, Simulation, Snapshot, StepContext
from frobs_core.description import Camera, Marker, ObservationTerm, Rewards, RewardTerm, Scene
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ConfigurationError, UnsuitableRobotError
from frobs_core.util.validation import finite, positive
from frobs_tasks_reach.reset_options import checked_goal
from frobs_tasks_reach.sampling import first_moving_link
from frobs_tasks_reach.start import EpisodeStart

_LIMIT_MARGIN = 0.1
"""Fraction of a joint's range by which observed positions may exceed the limits before they are clipped."""

_T = TypeVar("_T", float, Floats)


class Reach(EpisodeStart):
    """Task of moving the tool center point to a goal and holding it there.

    Goals are always reachable, because they are the tool positions of random joint vectors within the limits. Only
    positions in the goal box are used. Goals cover the reachable part of the box, but not uniformly: positions that can
    be reached in more ways are drawn more often. Goals inside the robot's base are excluded, but other self-collisions
    of the arm are not checked.

    Episodes never terminate. An episode is successful if the tool is within the tolerance of the goal at the time
    limit. Passing the goal is not sufficient: the tool must stay at the goal. At each step, ``is_success`` refers to
    the tool position at that step.

    The reward depends on the distance d from the tool to the goal:

    {rewards}

    Args:
        tolerance: Maximum distance between the tool and the goal at which the goal is considered reached [m].
        distance_weight: Penalty per meter of distance to the goal [1/m].
        precision_weight: Weight of the precision reward, which matters only within a few centimeters of the goal.
        keywords: Further parameters, which are passed to :class:`~frobs_tasks_reach.start.EpisodeStart`.

    Attributes:
        goal_low: Minimum corner of the goal box, (3,) [m], set by ``bind`` if not given.
        goal_high: Maximum corner of the goal box, (3,) [m], set by ``bind`` if not given.
        distance: Current distance from each tool to its goal, (num_envs,) [m].
        robot_name: Name of the robot that performs the task, as in the simulation. Set this attribute before calling
            ``bind``.

    Raises:
        ConfigurationError: A value is out of range.
    """

    reset_options: ClassVar[Sequence[str]] = ("goal", "joint_positions")
    control_timestep: ClassVar[float] = 0.04
    physics_timestep: ClassVar[float] = 0.002
    success_rule: ClassVar[str] = "the tool is within the tolerance of the goal at the time limit"
    instruction: ClassVar[str] = "Move the tool to the goal and hold it there."
    rewards: ClassVar[Rewards] = {
        "dense": {
            "distance": RewardTerm(
                function=lambda task: task.distance,
                weight="-distance_weight",
                meaning="d, where d is the distance from the tool to the goal",
                unit="m",
            ),
            "precision": RewardTerm(
                function=lambda task: np.exp(task.distance * task.distance * task.steepness),
                weight="precision_weight",
                meaning="exp(−(d / tolerance)²)",
            ),
        },
        "sparse": {
            "outside": RewardTerm(
                function=lambda task: np.where(task.distance <= task.tolerance, 0.0, -1.0),
                meaning="−1 if d > tolerance, otherwise 0",
            )
        },
    }

    robot_name: str = "robot"
    _sees_from_shoulder: ClassVar[bool] = True  # if False, goal_from_shoulder is not computed

    def __init__(
        self,
        *,
        tolerance: float = 0.05,
        distance_weight: float = 1.0,
        precision_weight: float = 0.5,
        **keywords: Any,
    ) -> None:
        super().__init__(**keywords)
        self.tolerance = positive("tolerance", tolerance)
        self.distance_weight = finite("distance_weight", distance_weight)
        self.precision_weight = finite("precision_weight", precision_weight)
        self.steepness = np.array(-1.0 / (tolerance * tolerance))  # [1/m²]
        self.reward_type = self.reward_types[0]

    def scene(self) -> Scene:
        """Return a scene with a floor and a camera that sees an arm at the origin and the arm's goal box."""
        scale = 1.0
        if self._given_low is not None and self._given_high is not None:
            x, y, z = np.maximum(np.abs(self._given_low), np.abs(self._given_high)).tolist()
            scale = max(1.0, max(x, y) / 0.6, z)
        eye = (1.35 * scale, -1.35 * scale, 1.05 * scale)
        return Scene(cameras={"overview": Camera(pos=eye, target=(0.0, 0.0, 0.4 * scale), fov_y=42.0)})

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        """Bind the task to a simulation.

        Raises:
            ConfigurationError: The robot has no joints, drives on wheels, or cannot reach any part of the goal box.
        """
        self._simulation = simulation
        self._robot: RobotHandle = control.robot(self.robot_name)
        if not self._robot.dof:
            raise UnsuitableRobotError(self._robot.robot.name, "has no actuated joints, so it cannot reach a goal.")
        if self._robot.robot.base == "wheeled":
            text = "has a wheeled base, which this task does not support; use 'frobs/Navigate-v0', or set base='fixed'."
            raise UnsuitableRobotError(self._robot.robot.name, text)
        self._bind_start(self._robot)
        self._goal, self._tcp, self._offset, self._from_shoulder = np.zeros((4, self._robot.num_envs, 3))
        self._shoulder = first_moving_link(self._robot.model, self._robot.frame_name("tcp"))
        self.distance: Floats = np.zeros(self._robot.num_envs)

    def advance(self, context: StepContext) -> None:
        """Measure the tool position."""
        self._measure()

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the joint positions, the tool position, the goal, and two vectors from tool to goal: dof + 12 numbers.

        The vector ``goal_offset`` is in the world frame. The vector ``goal_from_shoulder`` is in the frame of the
        shoulder (the first moving link). In this frame, the task for the other joints is the same at every shoulder
        angle.
        """
        robot = self._robot
        margin = _LIMIT_MARGIN * (robot.position_upper - robot.position_lower)
        lowest, highest = robot.position_lower - margin, robot.position_upper + margin
        held = np.empty_like(lowest)

        def joint_positions() -> Floats:
            np.maximum(robot.joint_positions, lowest, out=held)
            return np.minimum(held, highest, out=held)

        low, high = self._reach_box()
        goal_low, goal_high = self._goal_bounds()
        goal_low, goal_high = goal_low - self._goal_excursion(), goal_high + self._goal_excursion()
        farthest = np.full(3, np.sqrt((np.maximum(goal_high - low, high - goal_low) ** 2).sum()))
        return {
            "joint_positions": ObservationTerm(
                read=joint_positions,
                low=lowest[0],
                high=highest[0],
                unit="rad or m",
                proprioceptive=True,
            ),
            "tcp_position": ObservationTerm(
                read=lambda: self._tcp, low=low, high=high, unit="m", scale=2.0, proprioceptive=True
            ),
            "goal": ObservationTerm(read=lambda: self._goal, low=goal_low, high=goal_high, unit="m", scale=2.0),
            "goal_offset": ObservationTerm(
                read=lambda: self._offset, low=goal_low - high, high=goal_high - low, unit="m", scale=2.0
            ),
            "goal_from_shoulder": ObservationTerm(
                read=lambda: self._from_shoulder, low=-farthest, high=farthest, unit="m", scale=5.0
            ),
        }

    def is_success(self) -> Mask:
        """Return whether each tool is currently within the tolerance of its goal, (num_envs,) bool."""
        return self.distance <= self.tolerance

    @property
    def goal(self) -> Floats:
        """Current goals of the tools in the world frame, (num_envs, 3) [m]."""
        return self._goal

    def set_goal(self, position: Floats, mask: Mask | None = None) -> None:
        """Move the goals to ``position``, (n, 3) [m] in the world frame.

        Raises:
            ConfigurationError: A goal is outside the goal box, or the goals of this task move by themselves.
        """
        if self._goal_excursion():
            raise ConfigurationError(f"the goal of the task {type(self).__name__} moves by itself.")
        self._goal[rows_of(mask)] = checked_goal(np.asarray(position, float), *self._goal_bounds())
        self._compare()

    def markers(self) -> Sequence[Marker]:
        """Return a marker for the goal, whose radius is the tolerance, and a marker for the tool."""
        return (Marker(self._goal, self.tolerance), Marker(self._tcp, 0.012, (0.95, 0.45, 0.1, 1.0), "tool"))

    def stored_arrays(self) -> Snapshot:
        """Return the measured state and the goal."""
        return {"goal": self._goal, "tcp": self._tcp}

    def restore(self, snapshot: Snapshot) -> None:
        super().restore(snapshot)
        self._compare()

    # -- Methods that derived tasks override --

    def _measure(self) -> None:
        self._tcp[...] = self._robot.frame_pose("tcp")[0]
        self._compare()

    def _compare(self) -> None:
        np.subtract(self._goal, self._tcp, out=self._offset)
        self.distance = distance(self._offset)
        if self._sees_from_shoulder:
            turned = self._robot.frame_pose(self._shoulder)[1]
            turn_back(turned, self._offset, out=self._from_shoulder)


# The following functions are pure and elementwise, so that a row of a batch is bit-identical to a single row in any
# memory layout. For a single row, Python floats are faster, and they round in the same way.


def distance(offset: Floats) -> Floats:
    """Return the lengths of vectors.

    Args:
        offset: Vectors, (..., 3) [m].

    Returns:
        The lengths, (...) [m].
    """
    if offset.shape == (1, 3):
        ((x, y, z),) = offset.tolist()
        return np.array([math.sqrt(x * x + y * y + z * z)])
    x, y, z = np.moveaxis(offset, -1, 0)
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def turn_back(quat_wxyz: Floats, vector: Floats, out: Floats) -> None:
    """Express vectors in the coordinates of a rotated frame.

    Args:
        quat_wxyz: Orientation of the rotated frame, (n, 4).
        vector: Vectors in the reference frame of the orientation, (n, 3).
        out: Output array for the vectors in the rotated frame, (n, 3).
    """
    if len(vector) == 1:
        out[0] = _turned_back(*quat_wxyz[0].tolist(), *vector[0].tolist())
    else:
        out[:, 0], out[:, 1], out[:, 2] = _turned_back(*quat_wxyz.T, *vector.T)


def _turned_back(w: _T, x: _T, y: _T, z: _T, a: _T, b: _T, c: _T) -> tuple[_T, _T, _T]:
    p, q, r = b * z - c * y, c * x - a * z, a * y - b * x  # vector × axis, which rotates back
    p, q, r = p + p, q + q, r + r
    return a + (w * p + (q * z - r * y)), b + (w * q + (r * x - p * z)), c + (w * r + (p * y - q * x))
