"""Output of ``frobs train`` and ``frobs resume``: a live progress bar, and a summary at the end."""

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
    """Train while showing a live progress bar, and print the result.

    Args:
        headline: Description of the training run.
        total_steps: Total number of environment steps.
        train: Function that trains a policy. The function receives a callback, and calls this callback with the
            progress after each log row.
        json: Whether to write only JSON to stdout.
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
    """Return a one-line description of a training run and its threads.

    Args:
        config: Resolved configuration.
        begun: ``"training"`` or ``"resuming"``.
        where: The run folder.
    """
    from frobs_train import decide_threads

    seed = "a random seed" if config.seed is None else f"seed {config.seed}"
    environments = "1 environment" if config.num_envs == 1 else f"{config.num_envs:,} environments"
    return (
        f"{begun} {config.environment} with {config.algorithm}: {config.steps:,} steps, {environments}, {seed}, "
        f"{decide_threads(config)} → {where}"
    )
