"""Path search around obstacles with RRT-Connect, followed by shortcutting and corner rounding."""

from __future__ import annotations

import math
import threading
from time import perf_counter
from typing import Any

import numpy as np
from ompl import base, geometric, util

from frobs_controllers_planning.collision import CollisionChecker
from frobs_controllers_planning.path import RoundedPath
from frobs_core.util.arrays import Floats

_RANGE = 0.5
"""Maximum length of a tree step, measured as the motion of the robot's parts [m]."""

_SHORTCUTS = 40
_HALVINGS = 12
_LARGEST_CUT = 0.45  # maximum fraction of a line that is rounded at each end, so that part of every line stays straight

_OMPL = threading.Lock()  # serializes searches, because all of OMPL's random generators share one seed


class Search:
    """Path search that finds collision-free paths between two joint vectors.

    The same arguments always result in the same path, unless a deadline is set: the random numbers have a fixed seed,
    and the number of steps is limited instead of the computing time.

    Args:
        checker: Collision checker for joint positions and lines.
        lower: Lower position limits, (dof,) [rad or m], finite.
        upper: Upper position limits, (dof,) [rad or m], finite.
        max_steps: Maximum number of steps for growing the trees.
        seed: Seed for the random numbers, ≥ 1.

    Attributes:
        deadline: Time [s] at which the search stops, on the clock of :func:`time.perf_counter`. Infinite by default.
    """

    def __init__(self, checker: CollisionChecker, lower: Floats, upper: Floats, *, max_steps: int, seed: int) -> None:
        self._checker, self._lower, self._upper = checker, lower, upper
        self._max_steps, self._seed = max_steps, seed
        self.deadline = math.inf
        self._scale = np.maximum(checker.reach, 0.05)  # [m] displacement per unit of joint motion

    def find(self, start: Floats, goal: Floats) -> Floats | None:
        """Return waypoints (n, dof) between a collision-free start and goal, or None if no path is found."""
        if self._checker.is_way_free(start, goal):
            return np.stack([start, goal])
        path = self._connect(start, goal)
        return None if path is None else self._shorten(path)

    def _connect(self, start: Floats, goal: Floats) -> Floats | None:
        """Grow one search tree from each end until the two trees meet."""
        with _OMPL:
            util.setLogLevel(util.LogLevel.LOG_NONE)
            util.RNG.setSeed(self._seed)  # the seed applies only to objects that are created later
            space = base.RealVectorStateSpace(len(start))
            bounds = base.RealVectorBounds(len(start))
            for i, (low, high) in enumerate(zip(self._lower * self._scale, self._upper * self._scale, strict=True)):
                bounds.setLow(i, float(low))
                bounds.setHigh(i, float(high))
            space.setBounds(bounds)
            information = base.SpaceInformation(space)
            information.setStateValidityChecker(lambda state: self._checker.is_free(self._joints(state)))
            validator = _Lines(information, self)
            information.setMotionValidator(validator)
            information.setup()
            problem = base.ProblemDefinition(information)
            problem.setStartAndGoalStates(self._state(space, start), self._state(space, goal), 1e-9)
            planner = geometric.RRTConnect(information)
            planner.setRange(_RANGE)
            planner.setProblemDefinition(problem)
            planner.setup()
            steps = iter(range(self._max_steps))
            planner.solve(
                base.PlannerTerminationCondition(lambda: next(steps, None) is None or perf_counter() > self.deadline)
            )
            if not problem.hasExactSolution():
                return None
            states = problem.getSolutionPath().getStates()
            return np.stack([start, *[self._joints(state) for state in states[1:-1]], goal])

    def _joints(self, state: Any) -> Floats:
        return np.array([state[i] for i in range(len(self._scale))]) / self._scale

    def _state(self, space: Any, joint_positions: Floats) -> Any:
        state = space.allocState()
        for i, value in enumerate((joint_positions * self._scale).tolist()):
            state[i] = value
        return state

    def is_line_free(self, first: Any, second: Any) -> bool:
        """Return whether the second of two OMPL states and the line between them are collision-free."""
        start, end = self._joints(first), self._joints(second)
        return self._checker.is_free(end) and self._checker.is_way_free(start, end)

    def _shorten(self, waypoints: Floats) -> Floats:
        """Shorten the path with collision-free shortcuts between random points on it."""
        rng = np.random.default_rng(self._seed)
        for _ in range(_SHORTCUTS):
            if len(waypoints) == 2:
                break
            lengths = np.linalg.norm(np.diff(waypoints, axis=0) * self._scale, axis=1)
            ends = np.concatenate([[0.0], np.cumsum(lengths)])
            first, second = np.sort(rng.uniform(0.0, ends[-1], 2))
            if rng.random() < 0.3:  # use two waypoints as end points, so that the waypoints between them are removed
                first, second = ends[np.sort(rng.choice(len(ends), 2, replace=False))]
            i, j = (
                int(np.clip(np.searchsorted(ends, at, side="right") - 1, 0, len(lengths) - 1)) for at in (first, second)
            )
            if i == j:
                continue
            a, b = (
                waypoints[k] + (at - ends[k]) / max(lengths[k], 1e-12) * (waypoints[k + 1] - waypoints[k])
                for k, at in ((i, first), (j, second))
            )
            if self._checker.is_way_free(a, b) and self._checker.is_free(a) and self._checker.is_free(b):
                waypoints = _distinct(np.concatenate([waypoints[: i + 1], [a, b], waypoints[j + 1 :]]))
        return waypoints

    def round_off(self, waypoints: Floats) -> RoundedPath | None:
        """Round the path's corners as much as obstacles permit. Return None if a corner cannot be rounded."""
        lengths = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
        radii = _LARGEST_CUT * np.minimum(lengths[:-1], lengths[1:])
        for i in range(len(radii)):
            for _ in range(_HALVINGS):
                if self._is_corner_free(waypoints[i : i + 3], radii[i]):
                    break
                radii[i] *= 0.5
            else:
                return None
        return RoundedPath(waypoints, radii)

    def _is_corner_free(self, waypoints: Floats, radius: float) -> bool:
        """Return whether a rounded corner, defined by three waypoints, is collision-free."""
        steps = np.diff(waypoints, axis=0)
        directions = steps / np.linalg.norm(steps, axis=1, keepdims=True)
        ends = np.stack([waypoints[1] - radius * directions[0], waypoints[1], waypoints[1] + radius * directions[1]])
        corner = RoundedPath(ends, np.array([radius]))
        count = self._checker.count_checks(2.0 * radius * np.abs(directions).max(axis=0))
        positions = corner.evaluate(np.linspace(0.0, corner.length, count + 1))[0]
        return all(self._checker.is_free(q) for q in positions)


class _Lines(base.MotionValidator):
    """Motion validator that OMPL uses to check whether the line between two states is collision-free."""

    def __init__(self, information: Any, search: Search) -> None:
        super().__init__(information)
        self._search = search

    def checkMotion(self, first: Any, second: Any, *_: Any) -> bool:  # noqa: N802 - ompl's name
        return self._search.is_line_free(first, second)


def _distinct(waypoints: Floats) -> Floats:
    """Return the waypoints without consecutive duplicates. The start and the goal are kept."""
    moves = np.abs(np.diff(waypoints, axis=0)).max(axis=1) > 1e-6
    kept: Floats = waypoints[np.concatenate([[True], moves])]
    kept[-1] = waypoints[-1]
    return kept
