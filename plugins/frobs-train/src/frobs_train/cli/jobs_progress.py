"""Progress display for jobs on stderr: one bar per job in a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from frobs_cli.formats import duration, percent
from frobs_cli.output import console, one_line

if TYPE_CHECKING:
    from rich.progress import Progress as Bars

    from frobs_train import Progress
    from frobs_train.runners.runner import Outcome

_LINE_EVERY = 10.0  # interval between plain progress lines [s]


def collect_outcomes(
    names: Sequence[str], start: Callable[[Callable[[int, Progress], None]], Iterator[Outcome]], if_interrupted: str
) -> list[Outcome]:
    """Show the progress of jobs until all jobs have ended, and return their outcomes in job order.

    Args:
        names: Names of the jobs.
        start: Function that runs the jobs. The function receives a callback, and calls this callback with the index and
            the progress of a job.
        if_interrupted: Message of the KeyboardInterrupt that is raised if the user presses Ctrl-C.

    Returns:
        The outcome of each job. Use :func:`frobs_train.raise_failures` to raise an error if a job failed.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed.
    """
    outcomes = []
    with JobsProgress(names) as progress:
        try:
            for outcome in start(progress.update):
                outcomes.append(outcome)
                progress.finish(outcome)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(if_interrupted) from None
    return sorted(outcomes, key=lambda outcome: outcome.index)


def short_path(path: Path) -> str:
    """Return a path as text, relative to the working directory if possible."""
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


class JobsProgress:
    """Context manager that shows the progress of each job.

    Args:
        names: Names of the jobs.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names
        self._running: dict[int, Progress] = {}
        self._finished = 0
        self._console = console(stderr=True)
        self._bars: Bars | None = None
        self._next_line = time.monotonic() + _LINE_EVERY

    def __enter__(self) -> Self:
        """Show the bars."""
        if self._console.is_terminal:
            from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

            text = TextColumn("{task.description}", markup=False)
            numbers = TextColumn("{task.fields[numbers]}", markup=False)
            self._bars = Progress(text, BarColumn(bar_width=None), TaskProgressColumn(), numbers, console=self._console)
            self._tasks = [
                self._bars.add_task(one_line(name), total=1.0, numbers="not finished") for name in self._names
            ]
            self._bars.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Stop the bars and leave them on the screen."""
        if self._bars is not None:
            self._bars.stop()

    def update(self, index: int, progress: Progress) -> None:
        """Show the progress of the job ``index``."""
        self._running[index] = progress
        if self._bars is not None:
            done = min(1.0, progress.steps / progress.total_steps)
            self._bars.update(self._tasks[index], completed=done, numbers=_numbers(progress))
        elif time.monotonic() >= self._next_line:
            self._next_line = time.monotonic() + _LINE_EVERY
            shown = "; ".join(f"{self._names[job]} {_line(latest)}" for job, latest in sorted(self._running.items()))
            self._print(f"{self._finished} of {len(self._names)} finished; {shown}")

    def finish(self, outcome: Outcome) -> None:
        """Show that a job has ended."""
        self._finished += 1
        self._running.pop(outcome.index, None)
        if self._bars is not None:
            text = "finished" if outcome.error is None else "failed"
            self._bars.update(self._tasks[outcome.index], completed=1.0, numbers=text)
        else:
            text = "finished" if outcome.error is None else f"failed: {outcome.error}"
            self._print(f"{outcome.job.name} {text} ({self._finished} of {len(self._names)})")

    def _print(self, text: str) -> None:
        self._console.print(one_line(text), soft_wrap=True)


def _line(progress: Progress) -> str:
    return f"{percent(min(1.0, progress.steps / progress.total_steps), 0)} ({_numbers(progress)})"


def _numbers(progress: Progress) -> str:
    success = "" if progress.success is None else f"success {percent(progress.success)}, "
    return f"{success}{duration(progress.seconds_left)} left"
