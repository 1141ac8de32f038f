"""``frobs compare``: compare runs across seeds, with confidence intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.formats import duration, number, percent
from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note, print_table, print_title
from frobs_train.cli.runner_options import JobCpus, JobMemory, RayAddress, RunnerName, open_runner

if TYPE_CHECKING:
    from frobs_train import Comparison, Run
    from frobs_train.comparison.compare import Group
    from frobs_train.comparison.confidence import Estimate
    from frobs_train.runners.runner import Runner


class Metric(StrEnum):
    """Metrics for comparing runs."""

    success = "success"
    reward = "reward"


def compare(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", show_default=False, help="Run folders that 'frobs train' wrote.")
    ],
    metric: Annotated[
        Metric | None,
        typer.Option(show_default="success if every environment reports it, else reward", help="Metric to compare."),
    ] = None,
    threshold: Annotated[
        float | None,
        typer.Option(
            metavar="X",
            show_default="0.95 for success, none for reward",
            help="Count the steps until the metric reaches this value.",
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            metavar="FILE",
            dir_okay=False,
            show_default=False,
            help="Also save a plot of the comparison as a PNG file.",
        ),
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(
            "--evaluate",
            metavar="N",
            min=1,
            show_default=False,
            help="First evaluate each run on N new episodes, and compare the results of these evaluations.",
        ),
    ] = None,
    runner: RunnerName = "local",
    ray_address: RayAddress = None,
    cpus: JobCpus = None,
    memory: JobMemory = None,
    json: Json = False,
) -> None:
    """Compare the final metric, the steps to a threshold and the training speed of runs across seeds.

    Runs that differ only in the seed form a group. For each group, the command shows the interquartile mean over its
    seeds with a 95 % bootstrap interval. For each pair of groups in the same environment, the command shows the
    probability that a run of one group outperforms a run of the other group. Each environment has its own table.

    Example:
        $ frobs compare runs/frobs/Irb120Reach-v0/*
        $ frobs compare runs/ppo_* runs/sac_* --plot comparison.png
        $ frobs compare runs/a runs/b --metric reward --json
        $ frobs compare runs/frobs/*/* --evaluate 1000 --runner ray
    """
    from frobs_train import Run, plot_comparison
    from frobs_train import compare as compare_runs
    from frobs_train.runners.runner import LOCAL

    if episodes is None and runner != LOCAL:
        raise CommandLineError("--runner", "this option requires --evaluate N, because only evaluations run as jobs.")
    chosen = open_runner(runner, ray_address, cpus, memory)
    with only_json(json):
        opened = [Run.open(path) for path in runs]
        evaluations = None if episodes is None else _evaluate(opened, episodes, chosen)
        result = compare_runs(
            opened, metric=None if metric is None else metric.value, threshold=threshold, evaluations=evaluations
        )
        drawn = None if picture is None else plot_comparison(result, picture)
    if json:
        print_json({**result.to_dict(), "picture": drawn})
        return
    _print_groups(result)
    _print_rest(result)
    if drawn is not None:
        print_line()
        print_line(str(drawn))
    for note in result.notes:
        print_note(note)


def _evaluate(runs: Sequence[Run], episodes: int, runner: Runner) -> dict[Path, Mapping[str, Any]]:
    """Evaluate each run, and return a mapping from run folders to results."""
    from frobs_train.cli.evaluate_runs import run_evaluations
    from frobs_train.runners.jobs import evaluation_job
    from frobs_train.runners.runner import raise_failures

    outcomes = run_evaluations(
        [evaluation_job(path, episodes=episodes) for path in dict.fromkeys(run.path for run in runs)], runner
    )
    raise_failures(outcomes)
    return {outcome.result["run"]: outcome.result for outcome in outcomes}


def _print_groups(found: Comparison) -> None:
    several = len({group.environment for group in found.groups}) > 1
    reached = "" if found.threshold is None else f"steps to {_value(found, found.threshold, 0)}"
    columns = ["group", "seeds", found.metric, "95 % interval", reached, "time", "steps/s"]
    for environment in dict.fromkeys(group.environment for group in found.groups):
        groups = [group for group in found.groups if group.environment == environment]
        print_title(environment)
        rows = [_row(found, group) for group in groups]
        if found.threshold is None:
            rows = [[cell for index, cell in enumerate(row) if index != 4] for row in rows]
        print_table([column for column in columns if column], rows)
        if several:
            print_line()


def _row(found: Comparison, group: Group) -> list[str]:
    return [
        group.name,
        str(len(group.runs)),
        _value(found, group.final.value),
        _interval(found, group.final),
        _steps(group),
        duration(group.seconds),
        f"{group.steps_per_second:,.0f}",
    ]


def _print_rest(found: Comparison) -> None:
    if found.improvements:
        print_line()
        print_title("probability of improvement")
        several = len({group.environment for group in found.groups}) > 1
        names = {group.label: group.label if several else group.name for group in found.groups}
        rows = []
        for item in found.improvements:
            chance = item.probability
            sure = "" if chance.low is None else f"{percent(chance.low, 0)} to {percent(chance.high, 0)}"
            rows.append([names[item.first], f"over {names[item.second]}", percent(chance.value, 0), sure])
        print_table(["", "", "", "95 % interval"], rows)


def _steps(group: Group) -> str:
    if group.steps_to_threshold is not None and group.reached == len(group.runs):
        return f"{group.steps_to_threshold:,.0f}"
    reached = f"{group.reached} of {len(group.runs)} reached it"
    return reached if group.steps_to_threshold is None else f"{group.steps_to_threshold:,.0f} ({reached})"


def _value(found: Comparison, value: float, digits: int = 1) -> str:
    return percent(value, digits) if found.metric == "success" else number(value)


def _interval(found: Comparison, item: Estimate) -> str:
    if item.low is None or item.high is None:
        return "–"
    return f"{_value(found, item.low)} to {_value(found, item.high)}"
