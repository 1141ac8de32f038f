"""Progress display for a training run on stderr: a live bar in a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Self

from frobs_cli.formats import duration, number, percent
from frobs_cli.output import console, one_line

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from frobs_train import Progress

_LINE_EVERY = 10.0  # interval between plain progress lines [s]


class TrainingProgress:
    """Context manager that shows the steps, speed, success, reward and remaining time of a training run.

    The headline is printed only after training has begun, so invalid input produces only an error message. ``last`` is
    the latest progress, or None before the first report.
    """

    def __init__(self, headline: str, total_steps: int) -> None:
        self.last: Progress | None = None
        self._headline = headline
        self._total = total_steps
        self._console = console(stderr=True)
        self._bar: Bar | None = None
        self._next_line = 0.0

    def __enter__(self) -> Self:
        """Start the bar, so that it is visible while the environment is being built."""
        if self._console.is_terminal:
            from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

            text = TextColumn("{task.fields[numbers]}", markup=False)
            columns = BarColumn(bar_width=None), TaskProgressColumn(), text
            self._bar = Progress(*columns, console=self._console, expand=True, refresh_per_second=5)
            self._task = self._bar.add_task("", total=self._total, numbers="starting")
            self._bar.start()
        return self

    def __exit__(self, kind: object, *error: object) -> None:
        """Stop the bar, or print the last progress line if there is no bar.

        A bar that has not shown any progress is removed from the terminal.
        """
        if self._bar is not None:
            self._bar.live.transient = self.last is None
            self._bar.stop()
        elif self.last is not None and kind is None and self._next_line > time.monotonic():
            self._write_line(self.last)

    def update(self, progress: Progress) -> None:
        if self.last is None:
            self._console.print(one_line(self._headline), soft_wrap=True)
        self.last = progress
        if self._bar is not None:
            done = min(progress.steps, self._total)
            self._bar.update(self._task, completed=done, numbers=self._numbers(progress))
        elif time.monotonic() >= self._next_line:
            self._next_line = time.monotonic() + _LINE_EVERY
            self._write_line(progress)

    def _numbers(self, progress: Progress) -> str:
        parts = [f"{progress.steps_per_second:,.0f} steps/s"]
        if progress.success is not None:
            parts.append(f"success {percent(progress.success)}")
        if progress.evaluation is not None and progress.success is not None:
            parts.append(f"evaluated {percent(progress.evaluation)}")
        if progress.reward is not None:
            parts.append(f"reward {number(progress.reward)}")
        finished = progress.steps >= self._total
        parts.append(f"in {duration(progress.elapsed)}" if finished else f"{duration(progress.seconds_left)} left")
        return " · ".join(parts)

    def _write_line(self, progress: Progress) -> None:
        done = f"{progress.steps:,}/{self._total:,} steps ({percent(min(1.0, progress.steps / self._total), 0)})"
        self._console.print(f"{done} · {self._numbers(progress)}", soft_wrap=True)
