"""``frobs resume``: continue a training."""

from __future__ import annotations

from typing import Annotated

import typer

from frobs_cli.options import Json, RunFolder
from frobs_train.cli.training_report import describe_training, report_training


def resume(
    run: RunFolder,
    steps: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            show_default="the run's own",
            help="Environment steps in all; more than the run's own extend it.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Continue a training from its newest checkpoint, exactly where the simulator restores its state exactly.

    A training that was stopped, killed or cut off goes on as if it had never been; one that is complete is left as it
    is, unless --steps asks for more. Where the continuation cannot be exact, a line says why.

    Example:
        $ frobs resume runs/first
        $ frobs resume runs/first --steps 2_000_000
    """
    from frobs_train import Run
    from frobs_train import resume as resume_run

    opened = Run.open(run)
    config = opened.config if steps is None else opened.config.model_copy(update={"steps": steps})
    headline = describe_training(config, "resuming", str(run))
    report_training(
        headline, config.steps, lambda update: resume_run(opened, steps=steps, on_progress=update), json=json
    )
