"""``frobs evaluate RUN RUN …``: evaluate several runs as jobs, and print one table."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frobs_cli.formats import number, percent
from frobs_cli.output import only_json, print_json, print_table
from frobs_train.cli.jobs_progress import collect_outcomes

if TYPE_CHECKING:
    from frobs_train.runners.runner import Job, Outcome, Runner


def evaluate_and_report(jobs: Sequence[Job], runner: Runner, *, json: bool) -> None:
    """Evaluate several policies, and print a table with one row per policy.

    Args:
        jobs: Jobs created by :func:`frobs_train.runners.jobs.evaluation_job`.
        runner: Runner that runs the jobs.
        json: Whether to write only JSON to stdout.
    """
    from frobs_train.runners.runner import raise_failures

    with only_json(json):
        outcomes = run_evaluations(jobs, runner)
    results = {outcome.job.name: outcome.result for outcome in outcomes if outcome.error is None}
    if json:
        print_json(list(results.values()))
    elif results:
        rows = [_row(name, result) for name, result in results.items()]
        print_table(["environment", "run", "success", "95 % interval", "reward", "episodes"], rows)
    raise_failures(outcomes)


def run_evaluations(jobs: Sequence[Job], runner: Runner) -> list[Outcome]:
    """Run evaluation jobs, show their progress, and return their outcomes in job order."""
    runs = [run.parent for job in jobs if isinstance(run := job.arguments["run"], Path)]
    folder = Path(os.path.commonpath(runs)) if runs else Path.cwd()
    return collect_outcomes(
        [job.name for job in jobs],
        lambda update: runner.run(jobs, folder, update),
        "the results of the finished evaluations are in the run folders",
    )


def _row(name: str, found: Mapping[str, Any]) -> list[str]:
    interval = found["success_interval"]
    return [
        found["environment"],
        name,
        percent(found["success_rate"]),
        "–" if interval is None else f"{percent(interval[0])} to {percent(interval[1])}",
        number(found["mean_reward"]),
        f"{found['episodes']:,}",
    ]
