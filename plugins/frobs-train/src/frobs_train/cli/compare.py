"""``frobs compare``: compare runs across seeds, with confidence intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from frobs_cli.errors import CommandLineError
from frobs_cli.field_options import option
from frobs_cli.formats import duration, number, percent
from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note, print_table, print_title
from frobs_train.cli.plot import PictureOptions, RunFolders
from frobs_train.cli.runner_options import RunnerChoice

if TYPE_CHECKING:
    from frobs_train import Comparison, Run
    from frobs_train.comparison.compare import Group
    from frobs_train.comparison.confidence import Estimate
    from frobs_train.runners.runner import Runner


@dataclass(frozen=True, kw_only=True)
class CompareOptions:
    """Options of ``frobs compare``.

    Attributes:
        metric: Metric to compare.
        threshold: Count the steps until the metric reaches this value.
        picture: Also save a plot of the comparison as a PNG, PDF or SVG file.
        csv: Also write the results of all groups and seeds to a CSV file.
        markdown: Also write tables of the groups and the seeds to a Markdown file.
        latex: Also write tables of the groups and the seeds to a LaTeX file.
        episodes: First evaluate each run on N new episodes, and compare the results of these evaluations.
    """

    metric: Literal["success", "reward"] | None = option(
        None, show_default="success if every environment reports it, else reward"
    )
    threshold: float | None = option(None, show_default="0.95 for success, none for reward")
    picture: Path | None = option(None, name="plot", dir_okay=False)
    csv: Path | None = option(None, dir_okay=False)
    markdown: Path | None = option(None, dir_okay=False)
    latex: Path | None = option(None, dir_okay=False)
    episodes: int | None = option(None, name="evaluate", min=1)


def compare(
    runs: RunFolders,
    options: CompareOptions,
    look: PictureOptions,
    runner: RunnerChoice,
    json: Json = False,
) -> None:
    """Compare the final metric, the steps to a threshold and the training speed of runs across seeds.

    Runs that differ only in the seed form a group. For each group, the command shows the interquartile mean over its
    seeds with a 95 % bootstrap interval. For each pair of groups in the same environment, the command shows the
    probability that a run of one group outperforms a run of the other group. Each environment has its own table. Groups
    with runs in every environment are also compared over all environments.

    Example:
        $ frobs compare runs/frobs/Irb120Reach-v0
        $ frobs compare runs/ppo_* runs/sac_* --plot comparison.png
        $ frobs compare runs/a runs/b --metric reward --json
        $ frobs compare runs --latex table.tex --plot figure.pdf --size column
        $ frobs compare runs/frobs/*/* --evaluate 1000 --runner ray
    """
    from frobs_train import compare as compare_runs
    from frobs_train import find_runs, plot_comparison, write_table
    from frobs_train.plots.figures import check_picture

    episodes, picture = options.episodes, options.picture
    if picture is not None:
        check_picture(picture)  # before the evaluations, which may take long
    if episodes is None and not runner.is_local:
        raise CommandLineError("--runner", "this option requires --evaluate N, because only evaluations run as jobs.")
    chosen = runner.open()
    with only_json(json):
        opened = find_runs(runs)
        evaluations = None if episodes is None else _evaluate(opened, episodes, chosen)
        result = compare_runs(
            opened,
            metric=options.metric,
            threshold=options.threshold,
            evaluations=evaluations,
            source=look.source,
            over=look.over,
        )
        if picture is not None:
            plot_comparison(result, picture, size=look.size)
        for ending, path in ((".csv", options.csv), (".md", options.markdown), (".tex", options.latex)):
            if path is not None:
                write_table(result, path, ending)
    files = {"picture": picture, "csv": options.csv, "markdown": options.markdown, "latex": options.latex}
    if json:
        print_json({**result.to_dict(), **files})
        return
    written = [path for path in files.values() if path is not None]
    _print_groups(result)
    _print_rest(result)
    if written:
        print_line()
    for path in written:
        print_line(str(path))
    for note in result.notes:
        print_note(note)


def _evaluate(runs: Sequence[Run], episodes: int, runner: Runner) -> dict[Path, Mapping[str, Any]]:
    from frobs_train.cli.evaluate import run_evaluations
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
    if found.aggregates:
        print_line()
        print_title("all environments")
        rows = [
            [
                each.name,
                str(each.environments),
                str(each.runs),
                _value(found, each.final.value),
                _interval(found, each.final),
            ]
            for each in found.aggregates
        ]
        print_table(["group", "environments", "runs", found.metric, "95 % interval"], rows)
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
