"""``frobs tune``: search for better training settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.facts import print_facts, text
from frobs_cli.formats import duration
from frobs_cli.options import EnvId, Json
from frobs_cli.output import console, only_json, print_json, print_line, print_note, print_table, working
from frobs_train.cli.runner_options import RunnerChoice
from frobs_train.cli.train import RunFlags
from frobs_train.tuning.search import Search

if TYPE_CHECKING:
    from frobs_train import Progress, StudyResult, TrialResult
    from frobs_train.runners.runner import Runner

_SHOWN = 10  # maximum number of trials in the table


def tune(
    env_id: EnvId,
    flags: RunFlags,
    search: Search,
    runner: RunnerChoice,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Seed of the first run of each trial.")] = 0,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            dir_okay=False,
            help="Also plot the importance of each setting, and the metric over its values.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Search for better training settings.

    Each trial trains one run per seed and is scored by evaluating these runs. The best settings are written to a file
    that 'frobs train --config' accepts. If all trials have the same success rate, such as 0, the trial with the highest
    reward is the best. Run the same command again to continue an interrupted study, or to join a study that another
    process is running.

    Example:
        $ frobs tune frobs/Irb120Reach-v0 --trials 50 --steps 100_000
        $ frobs tune frobs/Irb120Reach-v0 --trials 50 --runner ray --pruner halving
        $ frobs tune CartPole-v1 --trials 20 --steps 20_000 --seeds 3 --space space.yaml
        $ frobs train frobs/Irb120Reach-v0 --config studies/frobs/Irb120Reach-v0/ppo/best.yaml
    """
    from frobs_core.plugins.registry import find_spec
    from frobs_train.plots.figures import check_picture

    find_spec(env_id)
    if report is not None:
        check_picture(report)  # before the search, which may take hours
    search = replace(search, environment=env_id, flags={**asdict(flags), "seed": seed})
    chosen = runner.open()
    with only_json(json):
        try:
            study = _watched(search, chosen)
        except KeyboardInterrupt:
            raise KeyboardInterrupt("run the same command again to continue the study") from None
    if not json:
        _print(study, env_id)
    if report is not None:
        from frobs_train.plots.plot_search import plot_search

        with only_json(json):
            plot_search(study, report)
    if json:
        print_json({**study.to_dict(), "report": report})
    elif report is not None:
        print_line(str(report))


def _watched(search: Search, runner: Runner) -> StudyResult:
    with working("preparing") as show:

        def on_progress(number: int, index: int, progress: Progress) -> None:
            seed = f", seed {index + 1} of {search.seeds}" if search.seeds > 1 else ""
            show(f"trial {number}{seed}: {progress.steps:,}/{progress.total_steps:,} steps")

        def on_trial(found: StudyResult, trial: TrialResult) -> None:
            print_note(_line(found, trial))
            show("choosing settings")

        return runner.tune(search, on_trial, on_progress)


def _line(found: StudyResult, trial: TrialResult) -> str:
    value = "" if trial.value is None else f" {trial.value:.4g}"
    best = f"; best {found.best.value:.4g} in trial {found.best.number}" if found.best is not None else ""
    error = f": {trial.error.splitlines()[0]}" if trial.error else ""
    took = "" if trial.seconds is None else f" after {duration(trial.seconds)}"
    return f"trial {trial.number} {trial.state}{value}{took}{error}{best}"


def _print(found: StudyResult, env_id: str) -> None:
    counts = {state: sum(trial.state == state for trial in found.trials) for state in ("complete", "pruned", "failed")}
    best = found.best
    facts: dict[str, object] = {
        "name": found.name,
        "kind": "study",
        "storage": found.storage,
        "trials": ", ".join(f"{count} {state}" for state, count in counts.items() if count),
        "best": None if best is None else f"{best.value:.4g} in trial {best.number}",
        "runs": None if best is None else ", ".join(str(path) for path in best.runs),
        "next": None if best is None else f"frobs train {env_id} --config {found.best_config}",
    }
    print_facts(facts)
    if found.tied and best is not None:
        print_note(
            f"All complete trials have the same success, {best.value:.4g}, so the best one has the highest reward; "
            "search with --metric reward, with more steps, or with an easier task."
        )
    ranked = sorted(found.trials, key=lambda trial: (trial.state != "complete", -(trial.value or 0.0)))
    keys = list(dict.fromkeys(key for trial in ranked for key in trial.settings))
    if ranked:
        console().print()
        print_table(
            ["trial", "value", *(key.rpartition(".")[2] for key in keys), "state"],
            [_row(trial, keys) for trial in ranked[:_SHOWN]],
        )
    if len(ranked) > _SHOWN:
        print_note(f"{len(ranked) - _SHOWN} more trials; --json lists all")


def _row(trial: TrialResult, keys: list[str]) -> list[str]:
    settings: Mapping[str, Any] = trial.settings
    cells = [text(_rounded(settings[key])) if key in settings else "–" for key in keys]
    value = "–" if trial.value is None else f"{trial.value:.4g}"
    state = f"{trial.state}: {trial.error.splitlines()[0]}" if trial.error else trial.state
    return [str(trial.number), value, *cells, state]


def _rounded(value: Any) -> Any:
    """Round a number. If a prefix such as ``lin_`` precedes the number, keep the prefix."""
    if isinstance(value, str) and "_" in value:
        prefix, _, number = value.rpartition("_")
        try:
            return f"{prefix}_{float(number):.3g}"
        except ValueError:
            return value
    return float(f"{value:.3g}") if isinstance(value, float) else value
