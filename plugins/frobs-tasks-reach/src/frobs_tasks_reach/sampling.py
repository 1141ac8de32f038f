"""Samples random joint vectors within the limits; their tool positions serve as reachable goals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.models import JointType, RobotModel, joint_path
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.random import RandomSource
from frobs_tasks_reach.floor import FloorClearance

_ROUNDS = (4, 16, 64, 256, 1024, 4096, 4096, 4096)
"""Number of candidates per environment in each round. The first rounds are small, because most draws succeed early."""

_POSTURES = 1024
"""Number of random joint vectors used to find links that can be above the floor, and to find a start posture."""

_START_CLEARANCE = 0.05
"""Minimum height of an arm above the floor at the start of an episode [m], which leaves room for drives to settle."""

_CHUNK = 2048
"""Maximum number of joint vectors per call of the forward kinematics, which limits memory use."""

Accept = Callable[[Floats], Mask]
"""Function that returns whether tool positions (..., 3) [m] in the world frame are acceptable, (...) bool."""


class JointSampler:
    """Sampler for random joint vectors within the limits whose tool positions satisfy a condition.

    Joint vectors are uniformly distributed. Postures in which part of the arm is below the floor are rejected, so that
    goals are feasible. Joints without limits use the range [−π, π].

    Args:
        robot: Handle of the robot.
        lower: Additional lower limits, (dof,) [rad or m].
        upper: Additional upper limits, (dof,) [rad or m].

    Attributes:
        lower: Lower limits of the joint vectors, (dof,) [rad or m].
        upper: Upper limits of the joint vectors, (dof,) [rad or m].
    """

    def __init__(self, robot: RobotHandle, lower: Floats | None = None, upper: Floats | None = None) -> None:
        self._robot = robot
        own_lower, own_upper = robot.position_lower[0], robot.position_upper[0]
        self.lower: Floats = np.where(np.isinf(own_lower), -np.pi, own_lower)
        self.upper: Floats = np.where(np.isinf(own_upper), np.pi, own_upper)
        if lower is not None:
            self.lower = np.maximum(self.lower, lower)
        if upper is not None:
            self.upper = np.minimum(self.upper, upper)
        self._still = _beside(robot.model, robot.frame_name("tcp"))
        self._floor = FloorClearance(robot, self._postures("floor", _POSTURES))

    def survey(self, count: int) -> Floats:
        """Return the tool positions, (count, 3) [m], for a fixed set of ``count`` joint vectors."""
        vectors = self._postures("survey", count)
        return np.concatenate([self._robot.frame_pose("tcp", chunk)[0] for chunk in _chunks(vectors, _CHUNK)])

    def start(self) -> Floats | None:
        """Return the posture (dof,) nearest to home in which the arm is at least 5 cm above the floor.

        Return None if home itself is such a posture or if no such posture is found; episodes then start at home.
        """
        home = self._robot.home[:1]
        vectors = self._postures("start", _POSTURES)
        floor = FloorClearance(self._robot, vectors, _START_CLEARANCE)
        if floor.is_clear(home)[0]:
            return None
        vectors = home + np.linspace(0.0, 1.0, _POSTURES)[:, None] * (vectors - home)  # nearest to home first
        clear = floor.is_clear(vectors)
        return np.asarray(vectors[clear.argmax()]) if clear.any() else None

    def _postures(self, stream: str, count: int) -> Floats:
        """Return a fixed set of ``count`` joint vectors within the limits, (count, dof) [rad or m]."""
        return np.asarray(self._drawn(stream, RandomSource(1), count, None)[0])

    def _drawn(self, stream: str, rng: RandomSource, count: int, mask: Mask | None) -> Floats:
        """Return joint vectors within the limits, (n, count, dof) [rad or m]. Legs and other arms keep their posture."""
        vectors = rng.uniform(stream, self.lower, self.upper, (count, len(self.lower)), mask)
        if self._still.any():
            vectors[..., self._still] = self._robot.home[0, self._still]
        return np.asarray(vectors, float)

    def draw(
        self, stream: str, rng: RandomSource, mask: Mask | None, accept: Accept, what: str
    ) -> tuple[Floats, Floats]:
        """Draw one joint vector for each environment by rejection sampling.

        Args:
            stream: Name of the random stream.
            rng: Source of the random numbers.
            mask: The n environments for which to draw.
            accept: Condition that the tool position must satisfy.
            what: Description of the draw, used in the error message.

        Returns:
            The joint positions (n, dof) [rad or m] and the tool positions (n, 3) [m] in the world frame.

        Raises:
            ConfigurationError: No acceptable joint vector was found after thousands of attempts for at least one
                environment.
        """
        dof = len(self.lower)
        open_rows = np.ones(self._robot.num_envs, bool) if mask is None else mask.copy()
        masked_rows = np.flatnonzero(open_rows)
        joint_positions, positions = np.empty((len(open_rows), dof)), np.empty((len(open_rows), 3))
        for count in _ROUNDS:
            for rows in _chunks(np.flatnonzero(open_rows), max(1, _CHUNK // count)):
                drawn_for = np.zeros(len(open_rows), bool)
                drawn_for[rows] = True
                candidates = self._drawn(stream, rng, count, drawn_for)  # (m, count, dof)
                reached = self._robot.frame_pose("tcp", candidates.reshape(-1, dof))[0].reshape(-1, count, 3)
                good = accept(reached)  # (m, count)
                good[good] = self._floor.is_clear(candidates[good])
                first = good.argmax(axis=1)
                valid = good[np.arange(len(rows)), first]
                joint_positions[rows[valid]] = candidates[valid, first[valid]]
                positions[rows[valid]] = reached[valid, first[valid]]
                open_rows[rows[valid]] = False
            if not open_rows.any():
                break
        if open_rows.any():
            raise ConfigurationError(
                f"no suitable joint vector was found for the {what}: {sum(_ROUNDS)} random joint vectors of robot "
                f"'{self._robot.robot.name}' were tried in environment {int(np.flatnonzero(open_rows)[0])}; choose a "
                "larger goal box, or initial='home'."
            )
        return joint_positions[masked_rows], positions[masked_rows]


def _beside(model: RobotModel, frame: str) -> Mask:
    """Return which actuated joints belong to a chain that has no moving joint in common with that to ``frame``, (dof,)."""
    carrying = {joint.name for joint in joint_path(model, frame) if joint.type is not JointType.FIXED}
    chains = {joint.name: joint_path(model, joint.child) for joint in model.joints}
    return np.array([carrying.isdisjoint(each.name for each in chains[name]) for name in model.joint_names])


def _chunks(rows: np.ndarray[Any, Any], size: int) -> Iterator[np.ndarray[Any, Any]]:
    return (rows[start : start + size] for start in range(0, len(rows), size))


def box_of(reached: Floats) -> tuple[Floats, Floats]:
    """Return the corners of a box that contains 95 % of the tool positions along each axis, above the floor.

    The corners are rounded outward to whole centimeters.

    Args:
        reached: Tool positions, (k, 3) [m]. Positions below the floor are ignored, unless all positions are below it.

    Returns:
        The minimum corner (3,) [m] and the maximum corner (3,) [m].
    """
    above = reached[reached[:, 2] > 0.0]
    low, high = np.percentile(above if len(above) else reached, (2.5, 97.5), axis=0)
    low[2] = max(low[2], 0.0) if len(above) else low[2]
    low, high = np.floor(low * 100.0) / 100.0, np.ceil(high * 100.0) / 100.0
    return low, np.maximum(high, low + 0.01)  # the box needs a volume even if the tool stays in a plane


def in_box(positions: Floats, low: Floats, high: Floats) -> Mask:
    """Return whether positions (..., 3) are in the closed box [``low``, ``high``], (...) bool."""
    return np.asarray(((positions >= low) & (positions <= high)).all(axis=-1))


def first_moving_link(model: RobotModel, frame: str) -> str:
    """Return the first moving link on the path from the root to ``frame``, or the root if no link moves."""
    moving = [joint.child for joint in joint_path(model, frame) if joint.type is not JointType.FIXED]
    return moving[0] if moving else model.root
