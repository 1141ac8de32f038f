"""What a run does while an algorithm trains: log, tell, keep checkpoints."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from frobs_core.runs.checkpoints import Checkpoint, write_checkpoint
from frobs_core.runs.progress import STEPS, ProgressLog
from frobs_core.runs.recorder import EpisodeRecorder, FinishedEpisodes
from frobs_core.runs.run import Run


@dataclass(frozen=True)
class Progress:
    """How far a training is.

    Attributes:
        steps: Environment steps so far.
        total_steps: Environment steps in all.
        elapsed: [s]
        steps_per_second: Since the start.
        seconds_left: [s] estimated.
        reward: Mean over the last 100 episodes; None before the first ends.
        length: Mean over the last 100 episodes [control steps].
        success: Mean over the last 100 episodes; None where the environment does not say.
    """

    steps: int
    total_steps: int
    elapsed: float
    steps_per_second: float
    seconds_left: float
    reward: float | None
    length: float | None
    success: float | None


class EpisodeStatistics:
    """Gathers finished episodes: those since the last row of the log, and the last 100."""

    def __init__(self) -> None:
        self._since: list[FinishedEpisodes] = []
        self.recent_rewards: deque[float] = deque(maxlen=100)
        self.recent_lengths: deque[int] = deque(maxlen=100)
        self.recent_successes: deque[float] = deque(maxlen=100)

    def add(self, finished: FinishedEpisodes) -> None:
        """Take the episodes of a step."""
        self._since.append(finished)
        self.recent_rewards.extend(finished.rewards.tolist())
        self.recent_lengths.extend(finished.lengths.tolist())
        if finished.successes is not None:
            self.recent_successes.extend(finished.successes.tolist())

    def take_row(self, terms: Sequence[str]) -> dict[str, float | None]:
        """Return the means over the episodes since the last call; None where there were none.

        Args:
            terms: Names of the reward terms, so that their columns stand before the first episode has ended.
        """
        episodes, self._since = self._since, []
        row: dict[str, float | None] = {"episode/count": sum(len(item.env_ids) for item in episodes)}
        row["episode/reward"] = _mean([item.rewards for item in episodes])
        row["episode/length"] = _mean([item.lengths.astype(np.float64) for item in episodes])
        row["episode/success"] = _mean([item.successes for item in episodes if item.successes is not None])
        for name in terms:
            row[f"reward/{name}"] = _mean([item.terms[name] for item in episodes if name in item.terms])
        return row


class RunMonitor:
    """Implements :class:`frobs_core.interfaces.TrainingMonitor` for a run folder.

    Args:
        run: The run.
        env: What is trained on; its snapshot becomes part of checkpoints.
        episodes: What the environment's recorder fills.
        log: Where rows go.
        tell: Called with the progress after each iteration; False ends the training.
    """

    def __init__(
        self,
        run: Run,
        env: EpisodeRecorder,
        episodes: EpisodeStatistics,
        log: ProgressLog,
        tell: Callable[[Progress], bool | None] | None = None,
    ) -> None:
        self._run = run
        self._env = env
        self._episodes = episodes
        self._log = log
        self._tell = tell
        self._every = run.config.checkpoint_every or max(1, run.config.steps // 10)
        self._next_checkpoint = self._every
        self._log_every = run.config.log_every or max(1, run.config.steps // 500)
        self._next_row = self._log_every
        self._last_checkpoint: Checkpoint | None = None
        self._start = time.perf_counter()
        self.steps = 0

    def is_due(self, steps: int) -> bool:
        """Return whether a row or a checkpoint is due."""
        return steps >= self._next_row or steps >= self._next_checkpoint

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Write a row and tell the progress; whoever is told may end the training."""
        self.steps = steps
        self._next_row = (steps // self._log_every + 1) * self._log_every
        elapsed = time.perf_counter() - self._start
        rate = steps / elapsed
        self._log.write(
            {
                "time/elapsed": elapsed,
                "time/steps_per_second": rate,
                STEPS: steps,
                **self._episodes.take_row(self._env.term_names),
                **metrics,
            }
        )
        return self._tell is None or self._tell(self._progress(steps, elapsed, rate)) is not False

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Write a checkpoint if one is due."""
        if steps >= self._next_checkpoint:
            self.write_checkpoint(steps, save)
            self._next_checkpoint = (steps // self._every + 1) * self._every

    def write_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Write a checkpoint now: ``algorithm/``, and ``environment.npz`` where the environment has a snapshot.

        Raises:
            CheckpointError: It cannot be written; those before are intact.
        """
        previous = None if self._last_checkpoint is None else self._last_checkpoint.path / "algorithm"

        def write(folder: Path) -> None:
            (folder / "algorithm").mkdir()
            save(folder / "algorithm", previous)
            snapshot = self._env.snapshot()
            if snapshot is not None:
                with (folder / "environment.npz").open("wb") as file:
                    np.savez(file, allow_pickle=False, **snapshot)

        keep = self._run.config.keep_checkpoints
        self._last_checkpoint = write_checkpoint(self._run.path / "checkpoints", steps, write, keep)

    def _progress(self, steps: int, elapsed: float, rate: float) -> Progress:
        total = self._run.config.steps
        recent = self._episodes
        return Progress(
            steps=steps,
            total_steps=total,
            elapsed=elapsed,
            steps_per_second=rate,
            seconds_left=max(0, total - steps) / rate,
            reward=float(np.mean(recent.recent_rewards)) if recent.recent_rewards else None,
            length=float(np.mean(recent.recent_lengths)) if recent.recent_lengths else None,
            success=float(np.mean(recent.recent_successes)) if recent.recent_successes else None,
        )


def _mean(parts: list[np.ndarray[tuple[int], np.dtype[np.float64]]]) -> float | None:
    return float(np.concatenate(parts).mean()) if parts else None
