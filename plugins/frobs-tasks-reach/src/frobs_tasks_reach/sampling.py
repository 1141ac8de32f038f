"""Random joint vectors inside the limits, and reachable goals: the tool positions of these vectors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import ConfigurationError
from frobs_core.interfaces import RobotHandle
from frobs_core.models import JointType, RobotModel, joint_path
from frobs_core.random import RandomSource
from frobs_tasks_reach.floor import FloorClearance

_ROUNDS = (4, 16, 64, 256, 1024, 4096, 4096, 4096)
"""Candidates per environment in each round: few at first, because most draws succeed immediately, then many."""

_POSTURES = 1024
"""Number of joint vectors for finding postures above the floor, and a start posture if home is not above it."""

_START_CLEARANCE = 0.05
"""Minimum height at the start of an episode [m], so that the drives can settle."""

_CHUNK = 2048
"""Number of joint vectors per forward-kinematics call, to limit memory."""

Accept = Callable[[Floats], Mask]
"""Function that takes tool positions (..., 3) [m] in the world and returns which are acceptable, (...) bool."""


class JointSampler:
    """Draws joint vectors uniformly inside the limits that bring the tool center point to an acceptable position.

    No part of the arm is below the floor, so goals are feasible. Joints without limits use [−π, π].

    Args:
        robot: Handle of the robot.
        lower: (dof,) additional lower limits [rad or m].
        upper: (dof,) additional upper limits [rad or m].

    Attributes:
        lower: (dof,) [rad or m]
        upper: (dof,) [rad or m]
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
        self._floor = FloorClearance(robot, self._postures("floor", _POSTURES))

    def survey(self, count: int) -> Floats:
        """Return the tool positions of ``count`` joint vectors, (count, 3) [m], the same in every call."""
        vectors = self._postures("survey", count)
        return np.concatenate([self._robot.frame_pose("tcp", chunk)[0] for chunk in _chunks(vectors, _CHUNK)])

    def start(self) -> Floats | None:
        """Return the posture (dof,) nearest home that is 5 cm above the floor, or None for home or if there is none."""
        home = self._robot.home[:1]
        vectors = self._postures("start", _POSTURES)
        floor = FloorClearance(self._robot, vectors, _START_CLEARANCE)
        if floor.is_clear(home)[0]:
            return None
        vectors = home + np.linspace(0.0, 1.0, _POSTURES)[:, None] * (vectors - home)  # nearest to home first
        clear = floor.is_clear(vectors)
        return np.asarray(vectors[clear.argmax()]) if clear.any() else None

    def _postures(self, stream: str, count: int) -> Floats:
        """Return ``count`` joint vectors inside the limits, (count, dof) [rad or m], the same in every call."""
        return np.asarray(RandomSource(1).uniform(stream, self.lower, self.upper, (count, len(self.lower)))[0])

    def draw(
        self, stream: str, rng: RandomSource, mask: Mask | None, accept: Accept, what: str
    ) -> tuple[Floats, Floats]:
        """Draw one joint vector for each environment, by rejection.

        Args:
            stream: Stream of random numbers.
            rng: Random source.
            mask: The n environments.
            accept: Condition for the tool's position.
            what: Description of the draw, for the error message.

        Returns:
            joint_positions (n, dof) [rad or m] and the tool's position (n, 3) [m] in the world.

        Raises:
            ConfigurationError: Thousands of joint vectors were tried in an environment, and none was acceptable.
        """
        dof = len(self.lower)
        open_rows = np.ones(self._robot.num_envs, bool) if mask is None else mask.copy()
        wanted = np.flatnonzero(open_rows)
        joint_positions, positions = np.empty((len(open_rows), dof)), np.empty((len(open_rows), 3))
        for count in _ROUNDS:
            for rows in _chunks(np.flatnonzero(open_rows), max(1, _CHUNK // count)):
                drawn_for = np.zeros(len(open_rows), bool)
                drawn_for[rows] = True
                candidates = rng.uniform(stream, self.lower, self.upper, (count, dof), drawn_for)  # (m, count, dof)
                reached = self._robot.frame_pose("tcp", candidates.reshape(-1, dof))[0].reshape(-1, count, 3)
                good = accept(reached)  # (m, count)
                good[good] = self._floor.is_clear(candidates[good])
                first = good.argmax(axis=1)
                found = good[np.arange(len(rows)), first]
                joint_positions[rows[found]] = candidates[found, first[found]]
                positions[rows[found]] = reached[found, first[found]]
                open_rows[rows[found]] = False
            if not open_rows.any():
                break
        if open_rows.any():
            raise ConfigurationError(
                f"{what}: {sum(_ROUNDS)} random joint vectors of robot '{self._robot.robot.name}' were tried in "
                f"environment {int(np.flatnonzero(open_rows)[0])} without success; choose a larger box."
            )
        return joint_positions[wanted], positions[wanted]


def _chunks(rows: np.ndarray[Any, Any], size: int) -> Iterator[np.ndarray[Any, Any]]:
    return (rows[start : start + size] for start in range(0, len(rows), size))


def box_of(reached: Floats) -> tuple[Floats, Floats]:
    """Return the box that contains 95 % of the positions along each axis, in whole centimeters, above the floor.

    Args:
        reached: (k, 3) tool positions [m]; those below the floor are ignored, unless all are below it.

    Returns:
        low (3,) and high (3,) [m].
    """
    above = reached[reached[:, 2] > 0.0]
    low, high = np.percentile(above if len(above) else reached, (2.5, 97.5), axis=0)
    low[2] = max(low[2], 0.0) if len(above) else low[2]
    low, high = np.floor(low * 100.0) / 100.0, np.ceil(high * 100.0) / 100.0
    return low, np.maximum(high, low + 0.01)  # a tool that stays in a plane needs goals, too


def in_box(positions: Floats, low: Floats, high: Floats) -> Mask:
    """Return which positions (..., 3) are in the closed box [low, high]; (...) bool."""
    return np.asarray(((positions >= low) & (positions <= high)).all(axis=-1))


def first_moving_link(model: RobotModel, frame: str) -> str:
    """Return the first moving link on the path from the root to ``frame``, or the root if none moves."""
    moving = [joint.child for joint in joint_path(model, frame) if joint.type is not JointType.FIXED]
    return moving[0] if moving else model.root
