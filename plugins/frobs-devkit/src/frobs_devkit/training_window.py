"""Timing the parts of a training run in memory, over whole iterations after a warm-up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from frobs_devkit.timing import Stopwatch
from frobs_train import RunConfig, prepare_training

SIMULATION, UPDATES, OTHER, ALGORITHM = "simulation", "updates", "other", "algorithm"

_WARM_UP = 2
"""Rounds of updates before the measurement: JAX compiles during the first ones."""

_LONGEST_WARM_UP = 30.0
"""Seconds after which the measurement starts even if there were no updates."""


@dataclass(frozen=True)
class MeasuredTraining:
    """Times of the measured iterations of a training run.

    Attributes:
        steps: Environment steps that were measured, over all environments.
        seconds: Their time [s].
        parts: Time of each part [s]; their sum is ``seconds``.
        calls: Time of each timed call [s], for each part that has timed methods.
        checkpoint_seconds: Time to save the algorithm once [s].
        uses_torch: Whether the updates change parameters of PyTorch.
    """

    steps: int
    seconds: float
    parts: dict[str, float]
    calls: dict[str, list[float]]
    checkpoint_seconds: float
    uses_torch: bool

    def per_step(self, part: str | None = None) -> float:
        """Return the time of a part, or of all parts, per environment step [s]."""
        return (self.seconds if part is None else self.parts.get(part, 0.0)) / self.steps


def measure_training(
    config: RunConfig, *, steps: int | None = None, seconds: float = 4.0, limit: float = inf
) -> MeasuredTraining:
    """Train in memory until enough was measured, and return the times.

    Args:
        config: See :func:`frobs_train.resolve_config`.
        steps: Environment steps to measure, rounded up to whole iterations; None: as many as ``seconds`` allow.
        seconds: Time to measure [s], at least two iterations.
        limit: Time, warm-up included, after which the training run ends with the next round of updates [s]. If it ends
            before the measurement began, the warm-up is part of the result.
    """
    made = prepare_training(config)
    with closing(made.env):
        stopwatch = Stopwatch()
        for method in ("reset", "step"):
            stopwatch.watch(SIMULATION, made.env, method)
        timed = made.algorithm.timed_parts()
        uses_torch = any(_has_torch_parameters(owner) for owner, _ in timed.get(UPDATES, ()))
        for part, methods in timed.items():
            for owner, method in methods:
                stopwatch.watch(part, owner, method, wait=True)
        window = _Window(stopwatch, lambda: made.recorder.steps, steps, seconds, limit)
        made.algorithm.train(config.steps + (steps or 0), window)
        return window.result(made.algorithm.save, uses_torch)


def _has_torch_parameters(model: object) -> bool:
    parameters = getattr(getattr(model, "policy", None), "parameters", tuple)
    return next(iter(parameters()), None) is not None


@dataclass(frozen=True)
class _Reading:
    time: float  # [s]
    steps: int
    rounds: int  # of updates
    calls: Mapping[str, int]  # number of timed calls of each part


class _Window:
    """A training monitor that measures whole iterations, and then ends the training run."""

    def __init__(
        self, stopwatch: Stopwatch, steps: Callable[[], int], wanted: int | None, seconds: float, limit: float
    ) -> None:
        self._stopwatch, self._steps = stopwatch, steps
        self._wanted, self._seconds, self._limit = wanted, seconds, limit
        self._has_updates = UPDATES in stopwatch.times
        self._reports = 0
        self._begin = self._read()
        self._latest = self._begin
        self._start: _Reading | None = None
        self._end: _Reading | None = None
        self._checkpoint_seconds: float | None = None

    def is_due(self, steps: int) -> bool:
        """Return whether enough was measured; without timed updates, ask for a report each time."""
        if self._has_updates:
            self._look()
        return self._end is not None or not self._has_updates

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Return whether more has to be measured."""
        self._reports += 1
        self._look()
        return self._end is None

    def on_episodes(self, rewards: Any, lengths: Any, successes: Any = None, terms: Any = None) -> None:
        """Ignore episodes."""

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Measure the time of a checkpoint after everything else was measured."""
        if self._end is not None and self._checkpoint_seconds is None:
            self._save(save)

    def result(self, save: Callable[[Path, Path | None], None], uses_torch: bool) -> MeasuredTraining:
        """Return the times; those of the whole training run if it ended before the warm-up did."""
        end = self._end or self._read()
        start = self._start if self._start is not None and self._start.steps < end.steps else self._begin
        calls = {part: times[start.calls[part] : end.calls[part]] for part, times in self._stopwatch.times.items()}
        seconds = end.time - start.time
        parts = {part: sum(times) for part, times in calls.items()}
        rest = OTHER if len(parts) > 1 else ALGORITHM
        parts[rest] = max(0.0, seconds - sum(parts.values()))
        if self._checkpoint_seconds is None:
            self._save(save)
        return MeasuredTraining(
            steps=end.steps - start.steps,
            seconds=seconds,
            parts=parts,
            calls=calls,
            checkpoint_seconds=self._checkpoint_seconds or 0.0,
            uses_torch=uses_torch,
        )

    def _look(self) -> None:
        """Start or end the measurement if an iteration has just ended."""
        if self._end is not None:
            return
        now = self._read()
        late = self._start is None and now.time - self._begin.time > _LONGEST_WARM_UP
        if now.rounds == self._latest.rounds and not late:
            return
        self._latest = now
        if now.time - self._begin.time > self._limit:
            self._end = now
        elif self._start is None:
            self._start = now if now.rounds >= _WARM_UP or late else None
        elif self._is_enough(self._start, now):
            self._end = now

    def _is_enough(self, start: _Reading, now: _Reading) -> bool:
        if self._wanted is not None:
            return now.steps - start.steps >= self._wanted
        return now.time - start.time >= self._seconds and now.rounds - start.rounds >= 2

    def _read(self) -> _Reading:
        calls = {part: len(times) for part, times in self._stopwatch.times.items()}
        rounds = calls[UPDATES] if self._has_updates else self._reports
        return _Reading(perf_counter(), self._steps(), rounds, calls)

    def _save(self, save: Callable[[Path, Path | None], None]) -> None:
        with TemporaryDirectory() as folder:
            start = perf_counter()
            save(Path(folder), None)
            self._checkpoint_seconds = perf_counter() - start
