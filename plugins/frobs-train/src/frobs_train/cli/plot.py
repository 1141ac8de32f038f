"""``frobs plot``: plot learning curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.output import print_line
from frobs_train.cli.picture_options import PictureOptions, RunFolders


def plot(
    runs: RunFolders,
    look: PictureOptions,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            dir_okay=False,
            show_default="plots/learning_curve.png in the run folder, or learning_curves.png next to the first run "
            "if there are several runs",
            help="PNG, PDF or SVG file to write.",
        ),
    ] = None,
) -> None:
    """Plot the learning curves of one or more runs.

    A folder stands for all runs in it. Reward terms are also plotted if all runs differ only in their seed.

    Example:
        $ frobs plot runs/first
        $ frobs plot runs/frobs/Irb120Reach-v0 --out seeds.png
        $ frobs plot runs/ppo_* --over time --size column --out figure.pdf
    """
    from frobs_train import find_runs, plot_runs

    print_line(str(plot_runs(find_runs(runs), out, source=look.source, over=look.over, size=look.size)))
