"""``frobs train``: train a policy."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.options import Algorithm, Base, Controller, EnvId, Json, NumEnvs, Robot, Seed, Simulator, Tcp
from frobs_cli.output import only_json, print_note
from frobs_train.cli.runner_options import JobCpus, JobMemory, RayAddress, RunnerName, open_runner
from frobs_train.cli.training_report import describe_training, report_training


class Service(StrEnum):
    """Experiment-tracking services."""

    wandb = "wandb"
    mlflow = "mlflow"


def train(
    env_id: EnvId,
    algorithm: Algorithm = None,
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", exists=True, dir_okay=False, show_default=False, help="YAML file with settings."),
    ] = None,
    robot: Robot = None,
    tcp: Tcp = None,
    base: Base = None,
    simulator: Simulator = None,
    controller: Controller = None,
    num_envs: NumEnvs = None,
    steps: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            show_default=False,
            help="Total number of environment steps, summed over all environments.",
        ),
    ] = None,
    seed: Seed = None,
    seeds: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            show_default=False,
            help="Train N runs with the seeds S, S+1, …, where S is the value of --seed (default 0). --run-dir is then "
            "the folder for all runs.",
        ),
    ] = None,
    runner: RunnerName = "local",
    ray_address: RayAddress = None,
    cpus: JobCpus = None,
    memory: JobMemory = None,
    run_dir: Annotated[
        Path | None,
        typer.Option(metavar="DIR", show_default="runs/ID/…", help="Run folder to write."),
    ] = None,
    log: Annotated[
        list[Service] | None,
        typer.Option(
            show_default=False,
            metavar="SERVICE",
            help="Also send the log to a service: wandb (Weights & Biases) or mlflow. The service's own environment "
            "variables apply, such as WANDB_MODE or MLFLOW_TRACKING_URI. Repeatable.",
        ),
    ] = None,
    on_existing: Annotated[
        str,
        typer.Option(
            metavar="WHAT",
            help="What to do if the run folder exists. error: stop with an error; increment: write DIR_2, DIR_3, …; "
            "overwrite: delete the existing run; resume: continue the existing run if its settings are the same.",
        ),
    ] = "error",
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            show_default=False,
            help="Value for any setting, such as algorithm_config.gamma=0.95 or environment_kwargs.tolerance=0.02. "
            "Repeatable.",
        ),
    ] = None,
    json: Json = False,
) -> None:
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
    from frobs_train.cli.train_seeds import train_and_report
    from frobs_train.configuration.advice import advise_controller
    from frobs_train.runners.runner import LOCAL

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
        "log": [service.value for service in log] if log else None,
    }
    with only_json(json):
        resolved = resolve_config(env_id, file=config, flags=flags, settings=settings or (), check_parts=True)
    if advice := advise_controller(resolved):
        print_note(advice)
    chosen = open_runner(runner, ray_address, cpus, memory)
    if seeds is not None or runner != LOCAL:
        train_and_report(resolved, seeds or 1, chosen, run_dir, on_existing, json=json)
        return
    folder = run_dir or default_run_dir(resolved)
    report_training(
        describe_training(resolved, "training", str(folder)),
        resolved.steps,
        lambda update: train_run(resolved, folder, update, on_existing=on_existing),
        json=json,
    )
