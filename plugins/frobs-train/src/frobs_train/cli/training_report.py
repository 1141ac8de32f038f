"""Output of ``frobs train`` and ``frobs resume``: a live progress bar, and a summary at the end."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Self

from frobs_cli.describe_fit import CHANGE, fit_rows
from frobs_cli.facts import print_facts, text
from frobs_cli.formats import duration, number, percent
from frobs_cli.output import console, one_line, only_json, print_json

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from frobs_train import Progress, Run, RunConfig


_LINE_EVERY = 10.0  # interval between plain progress lines [s]


class TrainingProgress:
    """Context manager that shows the steps, speed, success, reward and remaining time of a training run.

    The headline is printed only after training has begun, so invalid input produces only an error message. ``last`` is
    the latest progress, or None before the first report.
    """

    def __init__(self, headline: str, total_steps: int) -> None:
        self.last: Progress | None = None
        self._written: Progress | None = None
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
        elif self.last is not None and kind is None and self.last is not self._written:
            self._write_line(self.last)

    def update(self, progress: Progress) -> None:
        """Show the progress of training."""
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
        self._written = progress
        done = f"{progress.steps:,}/{self._total:,} steps ({percent(min(1.0, progress.steps / self._total), 0)})"
        self._console.print(f"{done} · {self._numbers(progress)}", soft_wrap=True)


_SHORT = ("robot", "simulator", "controller", "xacro_args", "package_paths", "attach", "randomize")

_DETAILS = (
    "controller_kwargs",
    *(f"gripper.{name}" for name in ("arm", "palm", "pads", "levers", "controller", "tcp.rpy")),
)
"""Settings that only ``frobs show ID --robot FILE`` lists."""


def report_training(
    headline: str, total_steps: int, train: Callable[[Callable[[Progress], None]], Run], *, json: bool
) -> None:
    """Train while showing a live progress bar, and print the result.

    The function ``train`` receives a callback, which it calls with the progress after each log row.
    """
    with only_json(json), TrainingProgress(headline, total_steps) as progress:
        run = train(progress.update)
    last = progress.last
    if json:
        print_json(
            {
                "run": run.path,
                **{key: getattr(run.config, key) for key in ("environment", "algorithm", "seed")},
                "steps": last.steps if last else max((item.steps for item in run.checkpoints), default=0),
                "seconds": last.elapsed if last else 0.0,
                **{key: getattr(last, key, None) for key in ("success", "reward", "length")},
            }
        )
        return
    facts: dict[str, object] = {"name": str(run.path), "kind": "run"}
    if last:
        facts["trained"] = f"{last.steps:,} steps in {duration(last.elapsed)} ({last.steps_per_second:,.0f} steps/s)"
        facts["success"] = f"{percent(last.success)} of the last 100 episodes" if last.success is not None else None
        facts["reward"] = f"{number(last.reward)} per episode" if last.reward is not None else None
    facts["next"] = f"frobs evaluate {run.path}"
    print_facts(facts)


def describe_fit(config: RunConfig) -> Iterator[str]:
    """Yield lines about the gripper that was found in a model file, and the settings that fit the task to the robot."""
    from frobs_core.plugins.registry import find_spec

    chosen = config.environment_kwargs
    if "gripper" not in chosen:
        return
    rows = fit_rows(
        {**find_spec(config.environment).kwargs, **config.keywords()},
        {key: value for key, value in chosen.items() if key not in _SHORT},
    )
    yield f"Found in the model file, and fitted to the robot ({CHANGE}):"
    for row in rows:
        if not row["setting"].startswith(_DETAILS) or row["setting"] == "controller_kwargs.max_delta":
            yield f"  {row['setting']:<27} {text(row['value'])}  {row['help']}".rstrip()


def describe_training(config: RunConfig, begun: str, where: str) -> str:
    """Return one line about a training run and its threads, which begins with ``"training"`` or ``"resuming"``."""
    from frobs_train import decide_threads

    seed = "a random seed" if config.seed is None else f"seed {config.seed}"
    environments = "1 environment" if config.total_envs == 1 else f"{config.total_envs:,} environments"
    if isinstance(config.num_envs, dict):
        environments += f" ({', '.join(f'{count:,} on {name}' for name, count in config.num_envs.items())})"
    return (
        f"{begun} {config.environment} with {config.algorithm}: {config.steps:,} steps, {environments}, {seed}, "
        f"{decide_threads(config)} → {where}"
    )
