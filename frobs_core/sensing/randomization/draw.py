"""A randomized quantity: the distribution and the times of its draws, and the numbers drawn so far."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import SettingError
from frobs_core.util.random import RandomSource

Shape = Literal["constant", "uniform", "log_uniform", "normal"]
"""Shapes of distributions."""

When = Literal["start", "reset", "interval"]
"""Times at which a number is drawn."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Distribution:
    """A distribution for random draws.

    Each parameter is a single number, or an array (k,) with one number for each component.

    Attributes:
        shape: Shape of the distribution.
        low: Lower bound, or the value of a constant distribution.
        high: Upper bound, or the value of a constant distribution.
        mean: Mean of the normal distribution before clipping.
        std: Standard deviation of the normal distribution before clipping.
        integer: Whether to draw one whole number in [low, high] for each environment, instead of components.
    """

    shape: Shape
    low: Floats
    high: Floats
    mean: Floats = field(default_factory=lambda: np.zeros(()))
    std: Floats = field(default_factory=lambda: np.zeros(()))
    integer: bool = False

    @property
    def width(self) -> int:
        """Number of components, which is 1 for scalars."""
        return max(array.size for array in (self.low, self.high, self.mean, self.std))

    def draw(self, rng: RandomSource, stream: str, width: int, mask: Mask | None) -> Floats:
        """Draw numbers, (n, width), or (n,) if they are whole, for the n environments selected by ``mask``."""
        if self.integer:
            return rng.integers(stream, int(self.low), int(self.high) + 1, (), mask).astype(np.float64)
        match self.shape:
            case "constant":
                n = rng.num_envs if mask is None else int(np.count_nonzero(mask))
                return np.broadcast_to(self.low, (n, width)).copy()
            case "uniform":
                return rng.uniform(stream, self.low, self.high, (width,), mask)
            case "log_uniform":
                return np.exp(rng.uniform(stream, np.log(self.low), np.log(self.high), (width,), mask))
            case "normal":
                return np.clip(rng.normal(stream, self.mean, self.std, (width,), mask), self.low, self.high)


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """One randomized quantity.

    Attributes:
        parameter: The randomized quantity, such as ``"mass"`` or ``"action_delay"``.
        place: Location of the setting for error messages, such as ``"randomize.mass"``.
        stream: Name of the random stream. In a snapshot, the name also identifies the drawn numbers.
        targets: Name patterns of the targets, or empty for the parameter's default targets.
        change: ``scale``, ``add`` or ``set``.
        distribution: Distribution of the drawn numbers. For a delay, these are whole numbers of control steps.
        schedule: When numbers are drawn.
        shared: Whether all targets use the same drawn number.
    """

    parameter: str
    place: str
    stream: str
    targets: tuple[str, ...]
    change: str
    distribution: Distribution
    schedule: Schedule
    shared: bool = False


class Draw(Stateful):
    """Numbers that are drawn repeatedly and stay constant between draws.

    Attributes:
        stream: Name of the random stream.
        numbers: Current values, (num_envs, …).
        changes_in_episode: Whether :meth:`step` may draw new numbers.
    """

    def __init__(self, setting: Setting, num_envs: int, control_timestep: float, width: int = 1) -> None:
        self.stream, self._when, self._distribution = setting.stream, setting.schedule.when, setting.distribution
        self.numbers: Floats = np.zeros((num_envs,) if setting.distribution.integer else (num_envs, width))
        self._width = width
        self.changes_in_episode = self._when == "interval"
        self._shortest, self._longest = setting.schedule.steps(control_timestep, setting.place)
        self._due = np.zeros(num_envs, np.uint64)  # step of the episode at which the next draw is due
        self._all = np.ones(num_envs, np.bool_)

    def begin(self, rng: RandomSource, mask: Mask) -> Mask:
        """Draw numbers for new episodes in the environments in ``mask``. Return a mask of those that got numbers."""
        rows = mask & (rng.episodes == 0) if self._when == "start" else mask
        if rows.any():
            self._draw(rng, rows)
        return rows

    def step(self, rng: RandomSource) -> Mask | None:
        """Draw the numbers that are due, and return a mask of the environments that got numbers, or None."""
        rows = self._all if self._longest == 1 else rng.steps >= self._due
        if rows is not self._all and not rows.any():
            return None
        self._draw(rng, rows)
        return rows

    def _draw(self, rng: RandomSource, rows: Mask) -> None:
        mask = None if rows is self._all or rows.all() else rows
        self.numbers[rows_of(mask)] = self._distribution.draw(rng, self.stream, self._width, mask)
        if self._longest > 1:
            low, high = self._shortest, self._longest
            wait = low if low == high else rng.integers(f"{self.stream}/interval", low, high + 1, (), mask)
            self._due[rows] = rng.steps[rows] + np.asarray(wait, np.uint64)

    def stored_arrays(self) -> Snapshot:
        return {"numbers": self.numbers, "due": self._due} if self.changes_in_episode else {"numbers": self.numbers}
