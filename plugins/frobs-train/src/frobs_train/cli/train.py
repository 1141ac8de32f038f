"""``frobs train``: train a policy."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frobs_cli.field_options import option
from frobs_cli.formats import duration, number, percent
from frobs_cli.options import Attach, Controller, EnvId, Gripper, Json, Robot, Seed, Simulator, Tcp
from frobs_cli.output import only_json, print_json, print_line, print_note, print_table, print_title
from frobs_core.util.errors import ConflictingOptionsError
from frobs_train.cli.jobs_progress import collect_outcomes, short_path
from frobs_train.cli.runner_options import RunnerChoice
from frobs_train.cli.training_report import describe_fit, describe_training, report_training
from frobs_train.cli.training_view import check_view, training_view

if TYPE_CHECKING:
    from frobs_train import RunConfig
    from frobs_train.runners.runner import Runner


@dataclass(frozen=True, kw_only=True)
class RunFlags:
    """Flags of :func:`frobs_train.resolve_config`.

    Attributes:
        algorithm: Training algorithm: a name from 'frobs list algorithms'.
        base: How the robot's root link can move: fixed, floating or wheeled.
        num_envs: Number of environments to simulate in parallel, or the number on each of several simulators, such as
            mujoco=48,pybullet=16.
        object: Object to manipulate, for tasks such as PickAndPlace: an STL, OBJ, COLLADA or URDF file, in meters.
        object_mass: Mass of the object of --object, in kg.
        object_scale: Factor for the lengths of the object of --object: 0.001 if it is in millimeters.
        steps: Total number of environment steps of a run, summed over all environments.
    """

    algorithm: str | None = option(None, show_default="that of the ID")
    robot: Robot = None
    tcp: Tcp = None
    gripper: Gripper = None
    attach: Attach = None
    base: str | None = option(None, metavar="KIND", show_default="the robot's base")
    simulator: Simulator = None
    controller: Controller = None
    num_envs: str | None = option(None, metavar="N | SIMULATOR=N,…")
    object: str | None = option(None, metavar="FILE", show_default="the task's object")
    object_mass: float | None = option(None, metavar="KG", show_default="from the object's volume")
    object_scale: float | None = option(None, metavar="S", show_default="1")
    steps: int | None = option(None, min=1)


class Service(StrEnum):
    """Experiment-tracking services."""

    wandb = "wandb"
    mlflow = "mlflow"


@dataclass(frozen=True, kw_only=True)
class TrainOptions:
    """Options of ``frobs train``.

    Attributes:
        config: YAML file with settings.
        seeds: Train N runs with the seeds S, S+1, …, where S is the value of --seed (default 0). --run-dir is then the
            folder for all runs.
        run_dir: Run folder to write.
        log: Also send the log to a service: wandb (Weights & Biases) or mlflow. The service's own environment variables
            apply, such as WANDB_MODE or MLFLOW_TRACKING_URI. Repeatable.
        on_existing: What to do if the run folder exists. error: stop with an error; increment: write DIR_2, DIR_3, …;
            overwrite: delete the existing run; resume: continue the existing run if its settings are the same.
        view: Show the newest policy of the run in the browser while it learns, with 'frobs view' of frobs-view.
        settings: Value for any setting, such as algorithm_config.gamma=0.95 or environment_kwargs.tolerance=0.02.
            Repeatable.
    """

    config: Path | None = option(None, exists=True, dir_okay=False)
    seed: Seed = None
    seeds: int | None = option(None, min=1)
    run_dir: Path | None = option(None, metavar="DIR", show_default="runs/ID/…")
    log: Sequence[Service] = option((), metavar="SERVICE")
    on_existing: str = option("error", metavar="WHAT")
    view: bool = option(False)
    settings: Sequence[str] = option((), name="set", metavar="KEY=VALUE")


def train(env_id: EnvId, flags: RunFlags, options: TrainOptions, runner: RunnerChoice, json: Json = False) -> None:
    """Train a policy on any Gymnasium environment, and write one run folder with everything needed to use the policy.

    Omitted settings default to the values tuned for the ID, or else to the algorithm's defaults. Flags override the
    --config file, and --set overrides everything else. Ctrl-C stops training after the current rollout and writes a
    checkpoint. A second Ctrl-C stops training immediately.

    Example:
        $ frobs train frobs/Irb120Reach-v0
        $ frobs train frobs/Irb120Reach-v0 --controller tcp_delta_position --seed 1
        $ frobs train CartPole-v1 --steps 100_000 --set algorithm_config.gamma=0.98
        $ frobs train frobs/Irb120Reach-v0 --seeds 10 --runner ray
        $ WANDB_MODE=offline frobs train frobs/Irb120Reach-v0 --log wandb
    """
    from frobs_core.plugins.registry import find_spec

    find_spec(env_id)  # check the ID before importing torch, so that a typo is reported immediately
    from frobs_train import default_run_dir, resolve_config
    from frobs_train import train as train_run

    chosen = {**asdict(flags), "seed": options.seed, "log": [service.value for service in options.log] or None}
    with only_json(json):
        resolved = resolve_config(
            env_id, file=options.config, flags=chosen, settings=options.settings, check_parts=True
        )
    if advice := _advise_controller(resolved):
        print_note(advice)
    for line in describe_fit(resolved):
        print_note(line)
    opened, on_existing = runner.open(), options.on_existing
    if options.view:
        _check_view(options, is_local=runner.is_local)
    if options.seeds is not None or not runner.is_local:
        _train_seeds(resolved, options.seeds or 1, opened, options.run_dir, on_existing, json=json)
        return
    folder = options.run_dir or default_run_dir(resolved)
    with training_view(folder) if options.view else nullcontext():
        report_training(
            describe_training(resolved, "training", str(folder)),
            resolved.steps,
            lambda update: train_run(resolved, folder, update, on_existing=on_existing),
            json=json,
        )


def _advise_controller(config: RunConfig) -> str | None:
    """Return a hint if the tuned settings of the ID's default controller need fewer steps than the chosen controller."""
    from frobs_core.plugins.registry import bare_id, environments
    from frobs_train import resolve_config

    id, chosen = bare_id(config.environment), config.environment_kwargs.get("controller")
    if id not in environments() or not isinstance(chosen, str):
        return None
    own = environments()[id][1].controller
    steps = {
        name: resolve_config(id, flags={"algorithm": config.algorithm, "controller": name}).steps
        for name in (own, chosen)
    }
    if steps[own] >= steps[chosen]:
        return None
    return (
        f"Training is faster with '--controller {own}', which needs {steps[own]:,} steps; '{chosen}' needs "
        f"{steps[chosen]:,}."
    )


def _check_view(options: TrainOptions, *, is_local: bool) -> None:
    check_view()
    if options.seeds is not None or not is_local:
        raise ConflictingOptionsError(["--view", "--seeds or --runner"], "a view shows one run of this machine")
    if options.on_existing == "increment":
        raise ConflictingOptionsError(["--view", "--on-existing increment"], "choose another --run-dir instead")


def _train_seeds(
    config: RunConfig, count: int, runner: Runner, run_dir: Path | None, on_existing: str, *, json: bool
) -> None:
    """Train with several seeds, beginning with the configured one or 0, and print a table with one row per seed."""
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
    print_line(f"next: {shlex.join(['frobs', 'compare', *(short_path(row['run']) for row in trained)])}")
