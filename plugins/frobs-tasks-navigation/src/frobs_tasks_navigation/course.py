"""Initial poses and waypoints of episodes."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from frobs_core.contracts import Snapshot, Stateful
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.random import RandomSource
from frobs_tasks_navigation import terms
from frobs_tasks_navigation.floor_plan import FloorPlan

_CANDIDATES = 16
"""Number of candidates drawn at once. The first candidate that is far enough from all objects is used."""


class Course(Stateful):
    """Initial poses and waypoints in all environments.

    Args:
        plan: Floor plan from which poses and waypoints are drawn.
        num_envs: Number of environments, ≥ 1.
        tolerance: Distance between the robot and a waypoint within which the waypoint is considered reached [m].

    Attributes:
        way: Waypoints, (num_envs, k, 2) [m]. In routes with fewer than k waypoints, the last waypoint is repeated.
        last: Index of the last waypoint, (num_envs,).
        index: Index of the next waypoint, (num_envs,).
        target: Position of the next waypoint, (num_envs, 2) [m].
    """

    def __init__(self, plan: FloorPlan, num_envs: int, tolerance: float) -> None:
        self._plan, self._tolerance = plan, tolerance
        longest = max((len(route) for route in plan.routes), default=1)
        self._routes: Floats = np.array([[*route, *[route[-1]] * (longest - len(route))] for route in plan.routes])
        self._lengths = np.array([len(route) for route in plan.routes])
        middles = [wall.middle for wall in plan.walls.pieces]
        self._wall_centre = np.array([centre for centre, _, _ in middles]).reshape(-1, 2)
        self._wall_yaw = np.array([yaw for _, _, yaw in middles])
        thickness = [wall.thickness or plan.walls.thickness for wall in plan.walls.pieces]
        self._wall_half = 0.5 * np.array([(m[1], t) for m, t in zip(middles, thickness, strict=True)]).reshape(-1, 2)
        self.way: Floats = np.zeros((num_envs, longest, 2))
        self.last: npt.NDArray[np.int64] = np.zeros(num_envs, np.int64)
        self.index: npt.NDArray[np.int64] = np.zeros(num_envs, np.int64)
        self.target: Floats = np.zeros((num_envs, 2))
        self._all = np.arange(num_envs)

    @property
    def left(self) -> Floats:
        """Number of remaining waypoints, (num_envs,)."""
        return np.asarray(self.last + 1.0 - self.index, np.float64)

    def advance(self, reached: Mask) -> Mask:
        """Advance to the next waypoint in the environments selected by ``reached``.

        Returns:
            Whether each route is complete, (num_envs,) bool.
        """
        at_the_end = self.index == self.last
        self.index += reached & ~at_the_end
        self._find_target()
        ended: Mask = reached & at_the_end
        return ended

    def set_goal(self, goal: Floats, rows: Mask | slice) -> None:
        """Make ``goal``, (n, 2) [m], the only waypoint in the environments ``rows``."""
        self.way[rows], self.last[rows], self.index[rows] = goal[:, None], 0, 0
        self._find_target()

    def _find_target(self) -> None:
        self.target[...] = self.way[self._all, self.index]

    def begin(
        self,
        mask: Mask | None,
        rng: RandomSource,
        boxes: tuple[Floats, Floats, Floats],
        given: tuple[Floats | None, ...],
    ) -> tuple[Floats, Floats]:
        """Draw an initial pose and a route for each of the n environments selected by the mask.

        Args:
            mask: The environments in which an episode begins.
            rng: Random source, of which the streams ``"start"``, ``"heading"``, ``"route"`` and ``"goal"`` are used.
            boxes: Centers (num_envs, k, 2) [m], yaw angles (num_envs, k) [rad] and half edge lengths (k, 2) [m] of the
                k ≥ 0 boxes.
            given: User-specified initial poses (n, 3) as x, y [m] and yaw [rad], and goals (n, 2) [m]. Initial poses
                and goals are drawn if they are None.

        Returns:
            The initial positions (n, 2) [m] and yaw angles (n,) [rad] of the robots.
        """
        rows = rows_of(mask)
        start, goal = given
        obstacles = (boxes[0][rows], boxes[1][rows], boxes[2])
        low, high = self._plan.start.box
        if start is not None:
            pos, yaw = start[:, :2], start[:, 2]
        else:
            pos = self._draw("start", rng, mask, low, high, obstacles, None)
            turned = self._plan.start.yaw
            yaw = rng.uniform("heading", -np.pi, np.pi, mask=mask)
            yaw = yaw if turned is None else np.full_like(yaw, math.radians(turned))
        self.index[rows] = 0
        if goal is not None:
            self.way[rows], self.last[rows] = goal[:, None], 0
        elif self._plan.goals is not None:
            corners = np.array(self._plan.goals.low), np.array(self._plan.goals.high)
            self.way[rows] = self._draw("goal", rng, mask, *corners, obstacles, pos)[:, None]
            self.last[rows] = 0
        else:
            route = rng.integers("route", 0, len(self._routes), mask=mask)
            self.way[rows], self.last[rows] = self._routes[route], self._lengths[route] - 1
        self._find_target()
        return pos, yaw

    def _draw(
        self,
        stream: str,
        rng: RandomSource,
        mask: Mask | None,
        low: Floats,
        high: Floats,
        obstacles: tuple[Floats, Floats, Floats],
        away_from: Floats | None,
    ) -> Floats:
        """Draw points (n, 2) [m] that are far enough from walls, boxes and the start, or else as far as possible."""
        if (low == high).all():
            return np.broadcast_to(low, (len(obstacles[0]), 2))
        candidates = rng.uniform(stream, low, high, (_CANDIDATES, 2), mask)  # (n, _CANDIDATES, 2)
        room = np.full(candidates.shape[:2], np.inf)
        centre, yaw, half = obstacles
        point = candidates[:, :, None]
        for rectangles in ((self._wall_centre, self._wall_yaw, self._wall_half), (centre[:, None], yaw[:, None], half)):
            distances = terms.distance_to_rectangles(point, *rectangles)
            room = np.minimum(room, distances.min(axis=-1, initial=np.inf))
        if away_from is not None:
            room = np.minimum(room, terms.distance(candidates - away_from[:, None]) - 2.0 * self._tolerance)
        clear = room >= self._plan.clearance
        chosen = np.where(clear.any(axis=1), clear.argmax(axis=1), room.argmax(axis=1))
        picked: Floats = candidates[np.arange(len(candidates)), chosen]
        return picked

    def stored_arrays(self) -> Snapshot:
        """Return each robot's route and its progress along the route."""
        return {"way": self.way, "last": self.last, "index": self.index}

    def restore(self, snapshot: Snapshot) -> None:
        super().restore(snapshot)
        self._find_target()
