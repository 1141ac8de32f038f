"""What ``frobs train`` and ``frobs resume`` have in common: the live bar, and the facts at the end."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from frobs_cli.facts import print_facts
from frobs_cli.formats import duration, number, percent
from frobs_cli.output import only_json, print_json
from frobs_train.cli.progress import TrainingProgress

if TYPE_CHECKING:
    from frobs_train import Progress, Run, RunConfig


def report_training(
    headline: str, total_steps: int, train: Callable[[Callable[[Progress], None]], Run], *, json: bool
) -> None:
    """Train with a live bar, and write what came of it.

    Args:
        headline: What is trained.
        total_steps: Environment steps in all.
        train: Trains, and calls what it is given after each row.
        json: Write JSON to stdout, and nothing else there.
    """
    with only_json(json), TrainingProgress(headline, total_steps) as progress:
        run = train(progress.update)
    last = progress.last
    if json:
        print_json(
            {
                "run": run.path,
                "environment": run.config.environment,
                "algorithm": run.config.algorithm,
                "seed": run.config.seed,
                "steps": last.steps if last else max((item.steps for item in run.checkpoints), default=0),
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


def describe_training(config: RunConfig, begun: str, where: str) -> str:
    """Say in one line what is trained, and who gets which processors.

    Args:
        config: Resolved.
        begun: ``"training"`` or ``"resuming"``.
        where: The run folder, and what else is to be said of it.
    """
    from frobs_train import decide_threads

    seed = "a random seed" if config.seed is None else f"seed {config.seed}"
    environments = "1 environment" if config.num_envs == 1 else f"{config.num_envs:,} environments"
    return (
        f"{begun} {config.environment} with {config.algorithm}: {config.steps:,} steps, {environments}, {seed}, "
        f"{decide_threads(config)} → {where}"
    )
