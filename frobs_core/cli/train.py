"""``frobs train``: learn a policy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frobs_core.cli.catalogue import find_spec
from frobs_core.cli.facts import print_facts
from frobs_core.cli.options import Controller, EnvId, Json, Robot, Seed, Simulator, Tcp
from frobs_core.cli.output import only_json, print_json
from frobs_core.cli.progress import TrainingProgress, duration, number, percent

if TYPE_CHECKING:
    from frobs_core.runs import RunConfig


def train(
    env_id: EnvId,
    algorithm: Annotated[
        str | None, typer.Option(metavar="NAME", show_default="ppo", help="One of 'frobs list algorithms'.")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", exists=True, dir_okay=False, show_default=False, help="YAML with settings."),
    ] = None,
    robot: Robot = None,
    tcp: Tcp = None,
    simulator: Simulator = None,
    controller: Controller = None,
    num_envs: Annotated[
        int | None, typer.Option(metavar="N", min=1, show_default=False, help="Environments stepped together.")
    ] = None,
    steps: Annotated[
        int | None, typer.Option(metavar="N", min=1, show_default=False, help="Environment steps, over all of them.")
    ] = None,
    seed: Seed = None,
    run_dir: Annotated[
        Path | None,
        typer.Option(metavar="DIR", show_default="runs/ID/…", help="The folder to write; it must not exist."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            show_default=False,
            help="Any setting, again for each: algorithm_config.gamma=0.95, environment_kwargs.tolerance=0.02.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Train a policy on any Gymnasium ID, and write one folder with all that it takes to use it.

    What is not given is as tuned for the ID, or as the algorithm's default. What is given here goes before the file,
    and --set before all.

    Example:
        $ frobs train frobs/Irb120Reach-v0
        $ frobs train frobs/Irb120Reach-v0 --controller tcp_delta_position --seed 1
        $ frobs train CartPole-v1 --steps 100_000 --set algorithm_config.gamma=0.98
    """
    find_spec(env_id)  # before torch is imported, so that a typing error is answered at once
    from frobs_core.runs import default_run_dir, resolve_config
    from frobs_core.runs import train as train_run

    flags = {
        "algorithm": algorithm,
        "robot": robot,
        "tcp": tcp,
        "simulator": simulator,
        "controller": controller,
        "num_envs": num_envs,
        "steps": steps,
        "seed": seed,
    }
    with only_json(json):
        resolved = resolve_config(env_id, file=config, flags=flags, settings=settings or ())
        folder = run_dir or default_run_dir(resolved)
        try:
            with TrainingProgress(_headline(resolved, folder), resolved.steps) as progress:
                run = train_run(resolved, folder, progress.update)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"the checkpoints so far are in {folder}" if folder.exists() else "") from None
    last = progress.last
    if json:
        print_json(
            {
                "run": run.path,
                "environment": resolved.environment,
                "algorithm": resolved.algorithm,
                "seed": run.config.seed,
                "steps": last.steps if last else 0,
                "seconds": last.elapsed if last else 0.0,
                "success": last.success if last else None,
                "reward": last.reward if last else None,
                "length": last.length if last else None,
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


def _headline(config: RunConfig, folder: Path) -> str:
    seed = "a seed drawn now" if config.seed is None else f"seed {config.seed}"
    environments = "1 environment" if config.num_envs == 1 else f"{config.num_envs:,} environments"
    return (
        f"training {config.environment} with {config.algorithm}: {config.steps:,} steps, {environments}, {seed}"
        f" → {folder}"
    )
