"""Schedules for random draws, and numbers that are drawn on a schedule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import SettingError
from frobs_core.util.random import RandomSource

Sample = Callable[[RandomSource, str, Mask | None], Floats]
"""Function that draws numbers, (n, …), from a stream for the n environments selected by a mask."""


class When(StrEnum):
    """Times at which a number is drawn."""

    START = "start"
    RESET = "reset"
    INTERVAL = "interval"


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """Schedule of the times at which a number is drawn.

    Attributes:
        when: ``start`` for one draw in the first episode after seeding, ``reset`` for one draw per episode, or
            ``interval`` for repeated draws within each episode.
        interval: Shortest and longest time between two draws, in control steps, or in seconds if ``in_seconds`` is set.
        in_seconds: Whether the interval is in seconds.
    """

    when: When
    interval: tuple[float, float] = (0.0, 0.0)
    in_seconds: bool = False

    def steps(self, control_timestep: float, place: str) -> tuple[int, int]:
        """Return the interval in control steps.

        Args:
            control_timestep: [s]
            place: Location of the setting for the error message, such as ``"randomize.mass"``.

        Raises:
            ConfigurationError: A time is not a multiple of the control timestep.
        """
        if not self.in_seconds:
            return int(self.interval[0]), int(self.interval[1])
        counts = [round(seconds / control_timestep) for seconds in self.interval]
        for seconds, count in zip(self.interval, counts, strict=True):
            if count < 1 or abs(count * control_timestep - seconds) > 1e-9 * seconds:
                raise SettingError(
                    place,
                    f"an interval of {seconds} s is not a whole number of control steps of {control_timestep} s; "
                    f"{max(1, count) * control_timestep:.10g} s would work.",
                )
        return counts[0], counts[1]


class Draw(Stateful):
    """Numbers that are drawn repeatedly and stay constant between draws.

    Args:
        stream: Name of the random stream, which also identifies the numbers in a snapshot.
        schedule: Times of the draws.
        sample: Function that draws the numbers.
        numbers: Values before the first draw, (num_envs, …).
        control_timestep: [s]

    Attributes:
        stream: Name of the random stream.
        numbers: Current values, (num_envs, …).
        changes_in_episode: Whether :meth:`step` may draw new numbers.
    """

    def __init__(
        self, stream: str, schedule: Schedule, sample: Sample, numbers: Floats, control_timestep: float
    ) -> None:
        self.stream = stream
        self.numbers = numbers
        self.changes_in_episode = schedule.when is When.INTERVAL
        self._when, self._sample = schedule.when, sample
        self._shortest, self._longest = schedule.steps(control_timestep, stream)
        self._due = np.zeros(len(numbers), np.uint64)  # step of the episode at which the next draw is due
        self._all = np.ones(len(numbers), np.bool_)

    def begin(self, rng: RandomSource, mask: Mask) -> Mask:
        """Draw numbers for new episodes in the environments in ``mask``, and return a mask of those that got numbers."""
        rows = mask & (rng.episodes == 0) if self._when is When.START else mask
        if rows.any():
            self._draw(rng, rows)
        return rows

    def step(self, rng: RandomSource) -> Mask | None:
        """Draw the numbers that are due, and return a mask of the environments that got numbers, or None if none did."""
        rows = self._all if self._longest == 1 else rng.steps >= self._due
        if rows is not self._all and not rows.any():
            return None
        self._draw(rng, rows)
        return rows

    def _draw(self, rng: RandomSource, rows: Mask) -> None:
        mask = None if rows is self._all or rows.all() else rows
        self.numbers[rows_of(mask)] = self._sample(rng, self.stream, mask)
        if self._longest > 1:
            low, high = self._shortest, self._longest
            wait = low if low == high else rng.integers(f"{self.stream}/interval", low, high + 1, (), mask)
            self._due[rows] = rng.steps[rows] + np.asarray(wait, np.uint64)

    def stored_arrays(self) -> Snapshot:
        """Return the current numbers and the times of the next draws."""
        return {"numbers": self.numbers, "due": self._due} if self.changes_in_episode else {"numbers": self.numbers}
