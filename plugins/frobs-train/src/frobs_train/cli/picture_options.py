"""Options of the commands that draw learning curves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from frobs_cli.field_options import option

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
