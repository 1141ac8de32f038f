"""Write logs, report progress, evaluate and write checkpoints while an algorithm trains."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from frobs_core.util.arrays import Floats
from frobs_train.environment_checks import has_time_limit
from frobs_train.logs.progress import STEPS, ProgressLog
from frobs_train.logs.recorder import EpisodeRecorder, FinishedEpisodes
from frobs_train.logs.statistics import EpisodeStatistics
from frobs_train.runs.checkpoints import Checkpoint, write_checkpoint
from frobs_train.runs.run import Run
from frobs_train.runs.state import RunState, write_arrays
from frobs_train.training.callbacks import TrainingCallback
from frobs_train.training.interrupts import Interrupts
from frobs_train.training.periodic_evaluation import TrainingEvaluation

_log = logging.getLogger("frobs")


@dataclass(frozen=True)
class Progress:
    """Progress of a training run.

    Attributes:
        steps: Number of environment steps so far.
        total_steps: Total number of environment steps.
        elapsed: Training time, including the time before interruptions [s].
        steps_per_second: Mean speed since the beginning of the run [environment steps/s].
        seconds_left: Estimated remaining time [s].
        reward: Mean reward per episode over the last 100 episodes, or None before the first episode ends.
        length: Mean length of the last 100 episodes [control steps], or None before the first episode ends.
        success: Success rate of the last 100 episodes, or None if the environment does not report success.
        evaluation: Success rate in the last evaluation, or else the mean reward. None before the first evaluation.
    """

    steps: int
    total_steps: int
    elapsed: float
    steps_per_second: float
    seconds_left: float
    reward: float | None
    length: float | None
    success: float | None
    evaluation: float | None = None


@dataclass(frozen=True, kw_only=True)
class RunContext:
    """The environment, log and callbacks of a training run."""

    env: EpisodeRecorder
    episodes: EpisodeStatistics
    log: ProgressLog
    interrupts: Interrupts
    snapshots: bool  # whether checkpoints contain a snapshot of the environment
    exact: bool  # whether the snapshot contains the environment's complete state
    evaluation: TrainingEvaluation | None = None
    callbacks: Sequence[TrainingCallback] = ()
    tell: Callable[[Progress], bool | None] | None = None  # called after each row; returning False ends training


class RunMonitor:
    """Implementation of :class:`frobs_core.contracts.TrainingMonitor` that writes to a run folder.

    A resumed run has a state, and the checkpoint from which it is resumed. ``steps`` is the number of environment steps
    at the last row or checkpoint, and ``stopped`` is the reason why the training run ends early, or None.
    """

    def __init__(
        self, run: Run, context: RunContext, state: RunState | None = None, checkpoint: Checkpoint | None = None
    ) -> None:
        config = run.config
        self._run = run
        self._context = context
        self._every: dict[str, float] = {
            "row": config.log_every or max(1, config.steps // 500),
            "checkpoint": config.checkpoint_every or max(1, config.steps // 10),
            "evaluation": math.inf if context.evaluation is None else (config.evaluate_every or math.inf),
        }
        self._next: dict[str, float] = {}  # number of steps at which each of these is due
        self._metrics: dict[str, float | None] = {} if state is None else dict(state.metrics)
        self._early = self._warned = False
        self._start = time.perf_counter() - (0.0 if state is None else state.elapsed)
        self.checkpoint = checkpoint
        self.stopped: str | None = None
        self.steps = 0 if state is None else state.steps
        self._plan(self.steps, *self._every)

    def _plan(self, steps: int, *what: str) -> None:
        """Determine after how many steps the next of some of the row, checkpoint and evaluation are due."""
        for name in what:
            self._next[name] = (steps // self._every[name] + 1) * self._every[name]
        self._soonest = min(self._next.values())

    def is_due(self, steps: int) -> bool:
        """Return whether a log row, an evaluation or a checkpoint is due, or an interruption has been requested."""
        if steps >= self._soonest:
            return True
        if self._context.interrupts.requested is None:
            return False
        self._early = True
        return True

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Write a log row, report the progress, and evaluate the policy if an evaluation is due.

        If an interruption is the only reason for this call, no row is written. The metrics are kept for the next row,
        so that the log is identical to the log of an uninterrupted run.
        """
        # A metric may be undefined: the explained variance, for example, if all returns are equal.
        self._metrics.update({name: value if math.isfinite(value) else None for name, value in metrics.items()})
        self.warn_if_endless()
        early, self._early = self._early, False
        if not early:
            self._write_row(steps)
        return self.stopped is None and self._context.interrupts.requested is None

    def warn_if_endless(self, finished: bool = False) -> None:
        """Warn once if no episode has ended, and the episodes are long or the training run is ``finished``."""
        env, longest = self._context.env, self._run.config.longest_episode
        steps = int(env.checks.lengths.max())
        if self._warned or self._context.episodes.recent_lengths or has_time_limit(env):
            return
        if steps >= longest or (finished and steps):
            self._warned = True
            _log.warning(
                "No episode of %s has ended after %s steps, so the log contains no rewards. If episodes never end, add "
                "a time limit: --set 'wrappers=[{name: gymnasium.wrappers:TimeLimit, max_episode_steps: 1000}]'.",
                self._run.config.environment,
                f"{steps:,}",
            )

    def on_episodes(
        self,
        rewards: Floats,
        lengths: npt.NDArray[np.int64],
        successes: Floats | None = None,
        terms: Mapping[str, Floats] | None = None,
    ) -> None:
        """Add episodes of environments that the algorithm steps in other processes."""
        nowhere = np.full(len(rewards), -1, np.intp)
        self._context.env.add_elsewhere(FinishedEpisodes(nowhere, rewards, lengths, successes, dict(terms or {})))

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Write a checkpoint if one is due or training stops."""
        stopping = self.stopped is not None or self._context.interrupts.requested is not None
        if stopping or steps >= self._next["checkpoint"]:
            self.write_checkpoint(steps, save)
            self._plan(steps, "checkpoint")

    def finish(self, save: Callable[[Path, Path | None], None]) -> None:
        """Write the final checkpoint, unless a checkpoint at this number of steps exists."""
        if self.checkpoint is None or self.checkpoint.steps != self.steps:
            self.write_checkpoint(self.steps, save)

    def write_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Write a checkpoint with ``algorithm/``, ``run.json``, ``run.npz`` and, if possible, ``environment.npz``."""
        context = self._context
        previous = None if self.checkpoint is None else self.checkpoint.path / "algorithm"
        state = RunState(
            steps=steps,
            elapsed=time.perf_counter() - self._start,
            metrics=self._metrics,
            stopped=self.stopped,
            exact=context.exact,
        )

        def write(folder: Path) -> None:
            (folder / "algorithm").mkdir()
            save(folder / "algorithm", previous)
            snapshot = context.env.snapshot() if context.snapshots else None
            if snapshot is not None:
                write_arrays(folder / "environment.npz", snapshot)
            state.write(folder, context.episodes.snapshot())

        context.log.sync()
        keep = self._run.config.keep_checkpoints
        self.checkpoint = write_checkpoint(self._run.path / "checkpoints", steps, write, keep, self.checkpoint)
        self.steps = steps
        for callback in context.callbacks:
            callback.on_checkpoint(self.checkpoint)

    def _write_row(self, steps: int) -> None:
        context = self._context
        evaluated: Mapping[str, float] = {}
        if context.evaluation is not None and steps >= self._next["evaluation"]:
            evaluated = context.evaluation.evaluate(steps)
            self.stopped = context.evaluation.why_stop()
        self.steps = steps
        elapsed = time.perf_counter() - self._start
        rate = steps / elapsed
        row: dict[str, float | None] = {
            "time/elapsed": elapsed,
            "time/steps_per_second": rate,
            STEPS: steps,
            **context.episodes.take_row(context.env.term_names),
            **context.env.metrics(),
            **self._metrics,
            **evaluated,
        }
        self._metrics = {}
        # Do not plan the next checkpoint here, because a checkpoint that is due is written only after this row.
        self._plan(steps, "row", "evaluation")
        context.log.write(row)
        progress = self._progress(steps, elapsed, rate)
        if context.tell is not None and context.tell(progress) is False:
            self.stopped = "the caller's on_progress function stopped the run"
        for callback in context.callbacks:
            if callback.on_progress(progress, row) is False:
                self.stopped = f"the callback {type(callback).__name__} stopped the run"

    def _progress(self, steps: int, elapsed: float, rate: float) -> Progress:
        total = self._run.config.steps
        recent, evaluation = self._context.episodes, self._context.evaluation
        return Progress(
            steps=steps,
            total_steps=total,
            elapsed=elapsed,
            steps_per_second=rate,
            seconds_left=max(0, total - steps) / rate,
            reward=float(np.mean(recent.recent_rewards)) if recent.recent_rewards else None,
            length=float(np.mean(recent.recent_lengths)) if recent.recent_lengths else None,
            success=float(np.mean(recent.recent_successes)) if recent.recent_successes else None,
            evaluation=None if evaluation is None else evaluation.latest,
        )
