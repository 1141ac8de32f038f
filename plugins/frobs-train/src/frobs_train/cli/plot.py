"""``frobs plot``: plot learning curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.output import print_line


def plot(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", show_default=False, help="Run folders that 'frobs train' wrote.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            dir_okay=False,
            show_default="plots/learning_curve.png in the run folder, or learning_curves.png next to the first run "
            "if there are several runs",
            help="PNG file to write.",
        ),
    ] = None,
) -> None:
    """Plot the learning curves of one or more runs as a PNG file.

    Reward terms are also plotted if all runs differ only in their seed.

    Example:
        $ frobs plot runs/first
        $ frobs plot runs/seed0 runs/seed1 runs/seed2 --out seeds.png
    """
    from frobs_train import Run, plot_runs

    print_line(str(plot_runs([Run.open(path) for path in runs], out)))
