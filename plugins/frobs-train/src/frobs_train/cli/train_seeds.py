"""``frobs train --seeds``: train with several seeds, and print a summary."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frobs_cli.formats import duration, number, percent
from frobs_cli.output import only_json, print_json, print_line, print_table, print_title
from frobs_train.cli.jobs_progress import collect_outcomes, short_path

if TYPE_CHECKING:
    from frobs_train import RunConfig
    from frobs_train.runners.runner import Runner


def train_and_report(
    config: RunConfig, count: int, runner: Runner, run_dir: Path | None, on_existing: str, *, json: bool
) -> None:
    """Train with several seeds, and print a table with one row per seed.

    Args:
        config: The configuration. The first run uses the configured seed, or 0 if no seed is configured.
        count: Number of seeds.
        runner: Runner that executes the training jobs.
        run_dir: See :func:`frobs_train.runners.seeds.train_seeds`.
        on_existing: See :func:`frobs_train.runners.seeds.train_seeds`.
        json: Whether to write only JSON to stdout.
    """
    from frobs_train.runners.runner import raise_failures
    from frobs_train.runners.seeds import train_seeds

    first = config.seed or 0
    seeds = list(range(first, first + count))
    with only_json(json):
        outcomes = collect_outcomes(
            [f"seed {seed}" for seed in seeds],
            lambda update: train_seeds(config, seeds, runner, run_dir, update, on_existing=on_existing),
            "repeat the command with --on-existing resume to continue the runs of all seeds",
        )
    trained = [outcome.result for outcome in outcomes if outcome.error is None]
    if json:
        print_json(trained)
    elif trained:
        _print(config, trained)
    raise_failures(outcomes)


def _print(config: RunConfig, trained: list[Mapping[str, Any]]) -> None:
    print_title(config.environment, config.algorithm)
    table = [
        [
            str(row["seed"]),
            percent(row["success"]),
            number(row["reward"]),
            duration(row["seconds"]),
            short_path(row["run"]),
        ]
        for row in trained
    ]
    print_table(["seed", "success", "reward", "time", "run"], table)
    print_line()
    print_line(f"next: frobs compare {short_path(trained[0]['run']).rstrip('0123456789')}*")
