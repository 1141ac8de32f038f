"""``frobs tune``: search for better training settings."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.facts import print_facts, text
from frobs_cli.formats import duration
from frobs_cli.options import Algorithm, Base, Controller, EnvId, Json, NumEnvs, Robot, Simulator, Tcp
from frobs_cli.output import console, only_json, print_json, print_note, print_table, working
from frobs_train.cli.compare import Metric
from frobs_train.cli.runner_options import JobCpus, JobMemory, RayAddress, RunnerName, open_runner

if TYPE_CHECKING:
    from frobs_train import Progress, Search, StudyResult, TrialResult
    from frobs_train.runners.runner import Runner

_SHOWN = 10
"""Maximum number of trials in the table."""


class Sampler(StrEnum):
    """Methods that choose settings."""

    tpe = "tpe"
    gp = "gp"
    random = "random"


class Pruner(StrEnum):
    """Methods that stop unpromising trials."""

    median = "median"
    halving = "halving"
    hyperband = "hyperband"
    population = "population"
    none = "none"


def tune(
    env_id: EnvId,
    trials: Annotated[
        int,
        typer.Option(metavar="N", min=1, help="Total number of trials in the study, including earlier ones."),
    ] = 50,
    algorithm: Algorithm = None,
    space: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            exists=True,
            dir_okay=False,
            show_default="the algorithm's search space",
            help="YAML file with the search space.",
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            exists=True,
            dir_okay=False,
            show_default=False,
            help="YAML file with settings for every trial.",
        ),
    ] = None,
    robot: Robot = None,
    tcp: Tcp = None,
    base: Base = None,
    simulator: Simulator = None,
    controller: Controller = None,
    num_envs: NumEnvs = None,
    steps: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, show_default=False, help="Number of environment steps in each run."),
    ] = None,
    seeds: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of runs per trial, each with its own seed.")
    ] = 1,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Seed of the first run of each trial.")] = 0,
    episodes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of evaluation episodes at the end of each run.")
    ] = 200,
    metric: Annotated[
        Metric | None,
        typer.Option(show_default="success if the environment reports it, else reward", help="Metric to maximize."),
    ] = None,
    sampler: Annotated[Sampler, typer.Option(help="Method that chooses the settings of each trial.")] = Sampler.tpe,
    pruner: Annotated[
        Pruner,
        typer.Option(
            help="Method that stops unpromising trials early. population replaces them with variants of better trials; "
            "it requires --runner ray."
        ),
    ] = Pruner.median,
    runner: RunnerName = "local",
    ray_address: RayAddress = None,
    cpus: JobCpus = None,
    memory: JobMemory = None,
    study_dir: Annotated[
        Path | None,
        typer.Option(metavar="DIR", show_default="studies/ID/ALGORITHM", help="Folder for the runs and best.yaml."),
    ] = None,
    storage: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            show_default="study.db in the --study-dir folder",
            help="Storage of the study: any storage URL that Optuna accepts.",
        ),
    ] = None,
    name: Annotated[
        str | None, typer.Option(metavar="NAME", show_default="ID/ALGORITHM", help="Name of the study in the storage.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            show_default=False,
            help="Fixed value for any setting, in the same form as for 'frobs train'. Fixed settings are not "
            "searched. Repeatable.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Search for better training settings.

    Each trial trains one run per seed and is scored by evaluating these runs. The best settings are written to a file
    that 'frobs train --config' accepts. Run the same command again to continue an interrupted study, or to join a study
    that another process is running.

    Example:
        $ frobs tune frobs/Irb120Reach-v0 --trials 50 --steps 100_000
        $ frobs tune frobs/Irb120Reach-v0 --trials 50 --runner ray --pruner halving
        $ frobs tune CartPole-v1 --trials 20 --steps 20_000 --seeds 3 --space space.yaml
        $ frobs train frobs/Irb120Reach-v0 --config studies/frobs/Irb120Reach-v0/ppo/best.yaml
    """
    from frobs_core.plugins.registry import find_spec

    find_spec(env_id)
    from frobs_train import Search

    flags = {
        "algorithm": algorithm,
        "robot": robot,
        "tcp": tcp,
        "base": base,
        "simulator": simulator,
        "controller": controller,
        "num_envs": num_envs,
        "steps": steps,
        "seed": seed,
    }
    search = Search(
        environment=env_id,
        trials=trials,
        file=config,
        flags=flags,
        settings=tuple(settings or ()),
        space=space,
        folder=study_dir,
        storage=storage,
        name=name,
        seeds=seeds,
        episodes=episodes,
        metric=None if metric is None else metric.value,
        sampler=sampler.value,
        pruner=pruner.value,
    )
    chosen = open_runner(runner, ray_address, cpus, memory)
    with only_json(json):
        try:
            study = _watched(search, chosen)
        except KeyboardInterrupt:
            raise KeyboardInterrupt("run the same command again to continue the study") from None
    if json:
        print_json(study.to_dict())
    else:
        _print(study, env_id)


def _watched(search: Search, runner: Runner) -> StudyResult:
    """Run the search, and print a live status and one line per trial to stderr."""
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
