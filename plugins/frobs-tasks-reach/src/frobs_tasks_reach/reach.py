"""Reach: hold the tool center point at a fixed goal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, TypeVar

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import UnsuitableRobotError
from frobs_core.interfaces import Camera, Controller, Marker, RobotHandle, Scene, Simulation, Snapshot, StepContext
from frobs_core.observation import ObservationTerm
from frobs_core.validation import finite, positive
from frobs_tasks_reach.sampling import first_moving_link
from frobs_tasks_reach.start import EpisodeStart

_LIMIT_MARGIN = 0.1
"""Fraction of a joint's range by which observed positions may exceed its limits; larger values are clipped."""

_T = TypeVar("_T", float, Floats)


class Reach(EpisodeStart):
    """Move the tool center point to a goal, and hold it there.

    Goals are tool positions of random joint vectors inside the limits that lie in the goal box, so they are always
    reachable. They cover the reachable part of the box, but not uniformly: positions that more joint vectors reach are
    more frequent. Goals inside the robot's base are excluded. Other self-collisions of the arm are not checked.

    An episode never terminates. It is a success if the tool is within the tolerance at the time limit: passing the goal
    is not enough, the tool must stay there. In each step, ``is_success`` refers to that step.

    Reward, with d the distance from tool to goal:

    - ``dense``: −distance_weight · d + precision_weight · exp(−(d / tolerance)²)
    - ``sparse``: 0 if d ≤ tolerance, otherwise −1

    Args:
        tolerance: Distance at which the goal is reached [m].
        goal_low: Minimum corner of the goal box in the world [m]. If None, it is derived from the tool's reach.
        goal_high: Maximum corner of the goal box in the world [m]. If None, it is derived from the tool's reach.
        initial: Joint positions at reset. ``"home"``: the robot's home, or the nearest posture found above the floor if
            part of the arm is in the floor there. ``"random"``: uniform inside the limits, with the tool at least 5 cm
            above the floor, as in FRobs_RL; this is harder to learn.
        distance_weight: Penalty per meter of distance [1/m].
        precision_weight: Weight of the reward term for the last few centimeters.

    Attributes:
        goal_low: (3,) minimum corner of the goal box [m]; set by ``bind`` if not given.
        goal_high: (3,) maximum corner of the goal box [m]; set by ``bind`` if not given.
        robot_name: Name in the simulation of the robot that performs the task; set before ``bind``.

    Raises:
        ConfigurationError: A value is out of range.
    """

    reward_types: ClassVar[Sequence[str]] = ("dense", "sparse")
    reset_options: ClassVar[Sequence[str]] = ("goal", "joint_positions")
    control_timestep: ClassVar[float] = 0.04
    physics_timestep: ClassVar[float] = 0.002
    success_rule: ClassVar[str] = "the tool is within the tolerance of the goal at the time limit"
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "distance": "−distance_weight · d, where d is the distance from tool to goal",
        "precision": "precision_weight · exp(−(d / tolerance)²), for the last centimeters",
        "outside": "−1 if d > tolerance, otherwise 0",
    }

    distance_term: ClassVar[str] = "distance"
    robot_name: str = "robot"
    _sees_from_shoulder: ClassVar[bool] = True  # if False, goal_from_shoulder is not computed

    def __init__(
        self,
        *,
        tolerance: float = 0.05,
        goal_low: Sequence[float] | None = None,
        goal_high: Sequence[float] | None = None,
        initial: str = "home",
        distance_weight: float = 1.0,
        precision_weight: float = 0.5,
    ) -> None:
        super().__init__(goal_low=goal_low, goal_high=goal_high, initial=initial)
        self.tolerance = positive("tolerance", tolerance)
        self.distance_weight = finite("distance_weight", distance_weight)
        self.precision_weight = finite("precision_weight", precision_weight)
        # Arrays, because NumPy takes three times as long to multiply by a Python float.
        self._tolerance, self._precision = np.array(self.tolerance), np.array(self.precision_weight)
        self._approach, self._steepness = np.array(-self.distance_weight), np.array(-1.0 / (tolerance * tolerance))
        self.reward_type = self.reward_types[0]

    def scene(self) -> Scene:
        """Return a floor, and a camera that sees the arm at the origin and its goal box."""
        scale = 1.0
        if self._given_low is not None and self._given_high is not None:
            x, y, z = np.maximum(np.abs(self._given_low), np.abs(self._given_high)).tolist()
            scale = max(1.0, max(x, y) / 0.6, z)
        eye = (1.35 * scale, -1.35 * scale, 1.05 * scale)
        return Scene(cameras={"overview": Camera(pos=eye, target=(0.0, 0.0, 0.4 * scale), fov_y=42.0)})

    def bind(self, simulation: Simulation, controller: Controller, control_timestep: float) -> None:
        """Prepare for a simulation.

        Raises:
            ConfigurationError: The robot has no joints, drives on wheels, or cannot reach any part of the goal box.
        """
        self._simulation = simulation
        self._robot: RobotHandle = simulation.robots[self.robot_name]
        if not self._robot.dof:
            raise UnsuitableRobotError(self._robot.robot.name, "has no actuated joint, so it cannot reach.")
        if self._robot.robot.base == "wheeled":
            text = "drives on wheels, but goals for its tool are fixed; use 'frobs/Navigate-v0', or base='fixed'."
            raise UnsuitableRobotError(self._robot.robot.name, text)
        self._bind_start(self._robot)
        self._goal, self._tcp, self._offset, self._from_shoulder = np.zeros((4, self._robot.num_envs, 3))
        self._shoulder = first_moving_link(self._robot.model, self._robot.frame_name("tcp"))
        self._distance: Floats = np.zeros(self._robot.num_envs)
        self._reward_terms: dict[str, Floats] = {}

    def advance(self, context: StepContext) -> None:
        """Measure the tool position."""
        self._measure()

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return joint positions, tool position, goal, and two vectors from tool to goal: dof + 12 numbers.

        ``goal_offset`` is in the world frame. ``goal_from_shoulder`` is in the frame of the shoulder, the first moving
        link, in which the task of the other joints looks the same for every angle of the shoulder.
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
            ),
            "tcp_position": ObservationTerm(read=lambda: self._tcp, low=low, high=high, unit="m", scale=2.0),
            "goal": ObservationTerm(read=lambda: self._goal, low=goal_low, high=goal_high, unit="m", scale=2.0),
            "goal_offset": ObservationTerm(
                read=lambda: self._offset, low=goal_low - high, high=goal_high - low, unit="m", scale=2.0
            ),
            "goal_from_shoulder": ObservationTerm(
                read=lambda: self._from_shoulder, low=-farthest, high=farthest, unit="m", scale=5.0
            ),
        }

    def reward(self, context: StepContext) -> Floats:
        """Return the reward, (num_envs,)."""
        if self.reward_type == "sparse":
            outside = missed(self._distance, self._tolerance)
            self._reward_terms = {"outside": outside}
            return outside
        distance: Floats = self._distance * self._approach
        precision: Floats = np.exp(self._distance * self._distance * self._steepness) * self._precision
        self._reward_terms = {self.distance_term: distance, "precision": precision}
        return distance + precision

    def reward_terms(self) -> Mapping[str, Floats]:
        """Return ``distance`` and ``precision`` (dense) or ``outside`` (sparse), (num_envs,) each."""
        return self._reward_terms

    def is_success(self) -> Mask:
        """Return which tools are within the tolerance now, (num_envs,) bool."""
        return self._distance <= self._tolerance

    @property
    def goal(self) -> Floats:
        """(num_envs, 3) [m] current goal of the tool in the world."""
        return self._goal

    @property
    def distance(self) -> Floats:
        """(num_envs,) [m] current distance from tool to goal."""
        return self._distance

    def markers(self) -> Sequence[Marker]:
        """Return a marker for the goal with the size of the tolerance, and one for the tool."""
        return (Marker(self._goal, self.tolerance), Marker(self._tcp, 0.012, (0.95, 0.45, 0.1, 1.0), "tool"))

    def snapshot(self) -> Snapshot:
        """Return the measured state and the goal."""
        return {"goal": self._goal.copy(), "tcp": self._tcp.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._goal[:] = snapshot["goal"]
        self._tcp[:] = snapshot["tcp"]
        self._compare()

    # -- Methods that derived tasks override --

    def _measure(self) -> None:
        self._tcp[...] = self._robot.frame_pose("tcp")[0]
        self._compare()

    def _compare(self) -> None:
        np.subtract(self._goal, self._tcp, out=self._offset)
        self._distance = distance(self._offset)
        if self._sees_from_shoulder:
            turned = self._robot.frame_pose(self._shoulder)[1]
            turn_back(turned, self._offset, out=self._from_shoulder)


# The terms are pure functions. They are all elementwise, so a row of a batch is bit-identical to a single row in any
# memory layout. For a single row, Python floats are faster; they round identically.


def distance(offset: Floats) -> Floats:
    """Return the length of vectors.

    Args:
        offset: (..., 3) [m]

    Returns:
        (...) [m]
    """
    if offset.shape == (1, 3):
        ((x, y, z),) = offset.tolist()
        return np.array([math.sqrt(x * x + y * y + z * z)])
    x, y, z = np.moveaxis(offset, -1, 0)
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def turn_back(quat_wxyz: Floats, vector: Floats, out: Floats) -> None:
    """Express vectors in the coordinates of a rotated frame.

    Args:
        quat_wxyz: (n, 4) orientation of the rotated frame.
        vector: (n, 3) in the frame that the orientation refers to.
        out: (n, 3) output, in the rotated frame.
    """
    if len(vector) == 1:
        out[0] = _turned_back(*quat_wxyz[0].tolist(), *vector[0].tolist())
    else:
        out[:, 0], out[:, 1], out[:, 2] = _turned_back(*quat_wxyz.T, *vector.T)


def _turned_back(w: _T, x: _T, y: _T, z: _T, a: _T, b: _T, c: _T) -> tuple[_T, _T, _T]:
    p, q, r = b * z - c * y, c * x - a * z, a * y - b * x  # vector × axis, which rotates back
    p, q, r = p + p, q + q, r + r
    return a + (w * p + (q * z - r * y)), b + (w * q + (r * x - p * z)), c + (w * r + (p * y - q * x))


def missed(distance: Floats, tolerance: Floats) -> Floats:
    """Return the sparse reward: 0 if the distance is at most the tolerance, otherwise −1.

    Args:
        distance: (...) [m]
        tolerance: () [m]
    """
    return np.where(distance <= tolerance, 0.0, -1.0)
