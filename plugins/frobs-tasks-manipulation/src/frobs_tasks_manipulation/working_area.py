"""Area of the floor in which objects and goals are placed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_core.contracts import Task
from frobs_core.description import Camera
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ResetOptionError
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import quat_from_axis_angle
from frobs_core.util.validation import numbers

UP: Floats = np.array([0.0, 0.0, 1.0])

_CANDIDATES = 16
"""Number of candidate positions drawn at once. The first position that is far enough from the other object is used."""


class WorkingArea:
    """Square area of the floor.

    Args:
        center: Center of the area in the world frame, (2,) [m].
        side: Side length of the area [m].
    """

    def __init__(self, center: Floats, side: float) -> None:
        self.center, self.side = center, side

    def whole_view(self) -> Camera:
        """Return a camera that shows an arm at the origin and the area, at a distance that suits the arm."""
        x, y = self.center.tolist()
        reach = 0.2 + 0.6 * math.hypot(x, y)  # small arms are higher than wide
        return Camera(pos=(3.2 * reach, y - 2.3 * reach, 2.0 * reach), target=(0.64 * x, y, 0.6 * reach), fov_y=36.0)

    def draw(
        self,
        stream: str,
        rng: RandomSource,
        mask: Mask | None,
        *,
        height: float,
        apart_from: Floats | None = None,
        distance: float = 0.0,
    ) -> Floats:
        """Draw positions uniformly from the area.

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
        half = self.side / 2
        candidates = rng.uniform(stream, -half, half, (_CANDIDATES, 2), mask) + self.center  # (n, candidates, 2)
        if apart_from is None:
            chosen = candidates[:, 0]
        else:
            offset = candidates - apart_from[:, None, :2]
            away = np.sqrt((offset * offset).sum(axis=2))
            ranks = np.where(away >= distance, np.arange(_CANDIDATES, 0, -1) + 10.0, away)
            chosen = candidates[np.arange(len(candidates)), ranks.argmax(axis=1)]
        return np.concatenate([chosen, np.full((len(chosen), 1), height)], axis=1)

    def chosen(self, option: str, options: Mapping[str, Floats], drawn: Floats, lowest: float) -> Floats:
        """Return the positions (n, 3) [m] that were passed to ``reset``, or else those that were drawn.

        Args:
            option: Name of the reset option for the positions.
            options: All reset options that the caller passed.
            drawn: Positions that are used without the option, (n, 3) [m].
            lowest: Minimum height of the positions [m].

        Raises:
            ResetOptionError: A position does not consist of three finite numbers, is below ``lowest``, or is more than 1 m
                from the center of the area.
        """
        if option not in options:
            return drawn
        place = options[option]
        if place.shape[1:] != (3,):
            raise ResetOptionError(option, f"has the shape {place.shape[1:]}; it must be (3,): x, y, z [m].")
        if not np.isfinite(place).all():
            raise ResetOptionError(option, "contains NaN or infinite values; it must contain finite positions [m].")
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


def draw_turn(stream: str, rng: RandomSource, mask: Mask | None, largest: float = np.pi / 12) -> Floats:
    """Draw orientations (n, 4) of an object on the floor. By default, it is rotated so little that the fingers still fit.

    Args:
        stream: Name of the random stream.
        rng: Source of the random numbers.
        mask: The n environments for which to draw.
        largest: Maximum rotation about the vertical axis in both directions [rad].
    """
    return quat_from_axis_angle(UP, rng.uniform(stream, -largest, largest, (), mask))


def move_goal(task: Any, position: Floats, mask: Mask | None = None) -> None:
    """Move the goals of a task with a working area during an episode.

    Args:
        task: The task.
        position: New goals in the world frame, (n, 3) [m].
        mask: The n environments to change, or None for all.

    Raises:
        ConfigurationError: The task chooses its goal itself, or a goal is not finite, below the floor or far from the
            working area.
    """
    if "goal" not in task.reset_options:
        Task.set_goal(task, position, mask)
    given = np.asarray(position, float)
    task.goal[rows_of(mask)] = task.working_area.chosen("goal", {"goal": given}, given, task.rest_height)
