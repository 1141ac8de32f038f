"""``frobs plot``: plot learning curves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from frobs_cli.field_options import option
from frobs_cli.output import print_line

RunFolders = Annotated[
    list[Path],
    typer.Argument(
        metavar="RUN...", show_default=False, help="Run folders that 'frobs train' wrote, or folders with runs."
    ),
]


@dataclass(frozen=True, kw_only=True)
class PictureOptions:
    """Options of pictures.

    Attributes:
        source: Values that learning curves show: evaluations during training, or the episodes of training, in which the
            policy explores.
        over: Quantity on the x axis of learning curves: environment steps or time.
        size: Size of a picture: for a screen, or for the full page or one column of a paper.
    """

    source: Literal["evaluation", "training"] | None = option(
        None, name="curve", show_default="evaluation if every run has evaluations during training, else training"
    )
    over: Literal["steps", "time"] = option("steps")
    size: Literal["screen", "page", "column"] = option("screen")


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

    If you pass a folder, all runs in it are plotted. Reward terms are also plotted if all runs differ only in their seed.

    Example:
        $ frobs plot runs/first
        $ frobs plot runs/frobs/Irb120Reach-v0 --out seeds.png
        $ frobs plot runs/ppo_* --over time --size column --out figure.pdf
    """
    from frobs_train import find_runs, plot_runs

    print_line(str(plot_runs(find_runs(runs), out, source=look.source, over=look.over, size=look.size)))
