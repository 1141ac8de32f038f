"""``frobs resume``: continue a training run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from frobs_cli.field_options import option
from frobs_cli.options import Json, RunFolder
from frobs_train.cli.training_report import describe_training, report_training


@dataclass(frozen=True, kw_only=True)
class ResumeOptions:
    """Options of ``frobs resume``.

    Attributes:
        steps: Total number of environment steps. To extend the run, specify a number larger than its current total.
        settings: Setting to change for the rest of the run, such as keep_checkpoints=9 or
            environment_kwargs.tolerance=0.02. Repeatable.
    """

    steps: int | None = option(None, min=1, show_default="the run's total")
    settings: Sequence[str] = option((), name="set", metavar="KEY=VALUE")


def resume(
    run: RunFolder,
    options: ResumeOptions,
    json: Json = False,
) -> None:
    """Continue a training run from its newest checkpoint.

    If the simulator restores its state exactly, a run that was stopped or killed continues as if it had not been
    interrupted. If the resumed run may differ from an uninterrupted run, a message explains why. A complete run is left
    unchanged unless --steps exceeds its total number of steps. Changed settings are recorded in the run's history.json.
    --set rejects changes to settings that the checkpoints depend on, and explains why.

    Example:
        $ frobs resume runs/first
        $ frobs resume runs/first --steps 2_000_000
        $ frobs resume runs/first --set environment_kwargs.tolerance=0.02
    """
    from frobs_train import Run
    from frobs_train import resume as resume_run
    from frobs_train.training.resume import changed_config

    opened = Run.open(run)
    config = changed_config(opened, options.steps, options.settings)
    headline = describe_training(config, "resuming", str(run))
    report_training(
        headline,
        config.steps,
        lambda update: resume_run(opened, steps=options.steps, settings=options.settings, on_progress=update),
        json=json,
    )
