"""Times the parts of an in-memory training run, over whole iterations after a warm-up."""

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

_WARM_UP = 2  # number of unmeasured update rounds at the start of the training run, during which JAX compiles
_LONGEST_WARM_UP = 30.0  # maximum duration of the warm-up [s], after which the measurement starts even without updates


@dataclass(frozen=True)
class MeasuredTraining:
    """Times of the measured iterations of a training run."""

    steps: int  # environment steps, summed over all environments
    seconds: float  # time of these steps [s]
    parts: dict[str, float]  # time of each part [s]; the times add up to ``seconds``
    calls: dict[str, list[float]]  # times of all timed calls [s], for each part with timed methods
    checkpoint_seconds: float  # time to save the algorithm once [s]
    uses_torch: bool  # whether the updates change PyTorch parameters

    def per_step(self, part: str | None = None) -> float:
        """Return the time per environment step of one part, or of all parts together [s]."""
        return (self.seconds if part is None else self.parts.get(part, 0.0)) / self.steps


def measure_training(
    config: RunConfig, *, steps: int | None = None, seconds: float = 4.0, limit: float = inf
) -> MeasuredTraining:
    """Train in memory until enough steps have been measured, and return the times.

    The measurement takes ``steps``, rounded up to whole iterations, or else some ``seconds`` and at least two
    iterations. The run ends with the first round of updates after the ``limit`` [s], which includes the warm-up. If the
    limit is reached during the warm-up, so does the result.
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
    rounds: int  # number of update rounds
    calls: Mapping[str, int]  # number of timed calls of each part


class _Window:
    """A training monitor that measures whole iterations and then ends the training run."""

    def __init__(
        self, stopwatch: Stopwatch, steps: Callable[[], int], steps_to_measure: int | None, seconds: float, limit: float
    ) -> None:
        self._stopwatch, self._steps = stopwatch, steps
        self._wanted, self._seconds, self._limit = steps_to_measure, seconds, limit
        self._has_updates = UPDATES in stopwatch.times
        self._reports = 0
        self._told = 0  # steps that the algorithm reports, which may be updates or steps of other processes
        self._begin = self._read()
        self._latest = self._begin
        self._start: _Reading | None = None
        self._end: _Reading | None = None
        self._checkpoint_seconds: float | None = None

    def is_due(self, steps: int) -> bool:
        self._told = steps
        if self._has_updates:
            self._look()
        return self._end is not None or not self._has_updates

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        self._reports += 1
        self._told = steps
        self._look()
        return self._end is None

    def on_episodes(self, rewards: Any, lengths: Any, successes: Any = None, terms: Any = None) -> None:
        """Ignore episodes."""

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        if self._end is not None and self._checkpoint_seconds is None:
            self._save(save)

    def result(self, save: Callable[[Path, Path | None], None], uses_torch: bool) -> MeasuredTraining:
        """Return the measured times, or the times of the whole training run if it ended during the warm-up."""
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
        return _Reading(perf_counter(), max(self._steps(), self._told), rounds, calls)

    def _save(self, save: Callable[[Path, Path | None], None]) -> None:
        with TemporaryDirectory() as folder:
            start = perf_counter()
            save(Path(folder), None)
            self._checkpoint_seconds = perf_counter() - start
