"""Output of ``frobs train`` and ``frobs resume``: a live progress bar, and a summary at the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from frobs_cli.describe_fit import CHANGE, fit_rows
from frobs_cli.facts import print_facts, text
from frobs_cli.formats import duration, number, percent
from frobs_cli.output import only_json, print_json
from frobs_train.cli.progress import TrainingProgress

_SHORT = ("robot", "simulator", "controller", "xacro_args", "package_paths", "attach", "randomize")

_DETAILS = (
    "controller_kwargs",
    *(f"gripper.{name}" for name in ("arm", "palm", "pads", "levers", "controller", "tcp.rpy")),
)
"""Settings that only ``frobs show ID --robot FILE`` lists."""

if TYPE_CHECKING:
    from frobs_train import Progress, Run, RunConfig


def report_training(
    headline: str, total_steps: int, train: Callable[[Callable[[Progress], None]], Run], *, json: bool
) -> None:
    """Train while showing a live progress bar, and print the result.

    The function ``train`` receives a callback, which it calls with the progress after each log row.
    """
    with only_json(json), TrainingProgress(headline, total_steps) as progress:
        run = train(progress.update)
    last = progress.last
    if json:
        print_json(
            {
                "run": run.path,
                **{key: getattr(run.config, key) for key in ("environment", "algorithm", "seed")},
                "steps": last.steps if last else max((item.steps for item in run.checkpoints), default=0),
                "seconds": last.elapsed if last else 0.0,
                **{key: getattr(last, key, None) for key in ("success", "reward", "length")},
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


def describe_fit(config: RunConfig) -> Iterator[str]:
    """Yield lines about the gripper that was found in a model file, and the settings that fit the task to the robot."""
    from frobs_core.plugins.registry import find_spec

    chosen = config.environment_kwargs
    if "gripper" not in chosen:
        return
    rows = fit_rows(
        {**find_spec(config.environment).kwargs, **config.keywords()},
        {key: value for key, value in chosen.items() if key not in _SHORT},
    )
    yield f"Found in the model file, and fitted to the robot ({CHANGE}):"
    for row in rows:
        if not row["setting"].startswith(_DETAILS) or row["setting"] == "controller_kwargs.max_delta":
            yield f"  {row['setting']:<27} {text(row['value'])}  {row['help']}".rstrip()


def describe_training(config: RunConfig, begun: str, where: str) -> str:
    """Return one line about a training run and its threads, which begins with ``"training"`` or ``"resuming"``."""
    from frobs_train import decide_threads

    seed = "a random seed" if config.seed is None else f"seed {config.seed}"
    environments = "1 environment" if config.num_envs == 1 else f"{config.num_envs:,} environments"
    return (
        f"{begun} {config.environment} with {config.algorithm}: {config.steps:,} steps, {environments}, {seed}, "
        f"{decide_threads(config)} → {where}"
    )
