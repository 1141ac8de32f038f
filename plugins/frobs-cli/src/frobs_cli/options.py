"""Arguments and options that several commands share, so that they read the same everywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.completion import complete_id

Json = Annotated[bool, typer.Option("--json", help="Write JSON to stdout, and nothing else there.")]

EnvId = Annotated[
    str,
    typer.Argument(
        metavar="ID",
        show_default=False,
        help="A Gymnasium ID: one of 'frobs list envs', or any other ('CartPole-v1', 'module:Id-v0').",
        autocompletion=complete_id,
    ),
]

RunFolder = Annotated[
    Path, typer.Argument(metavar="RUN", show_default=False, help="The folder that 'frobs train' wrote.")
]

Robot = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        show_default="the environment's own",
        help="One of 'frobs list robots', or a URDF, xacro or MJCF file.",
    ),
]

Tcp = Annotated[
    str | None,
    typer.Option(metavar="LINK", show_default="the robot's own", help="The link that the task talks about."),
]

Base = Annotated[
    str | None,
    typer.Option(
        metavar="KIND",
        show_default="the robot's own",
        help="Whether the robot's root moves: fixed, floating or wheeled.",
    ),
]

Simulator = Annotated[
    str | None,
    typer.Option(metavar="NAME", show_default="the environment's own", help="One of 'frobs list simulators'."),
]

Controller = Annotated[
    str | None,
    typer.Option(metavar="NAME", show_default="the environment's own", help="One of 'frobs list controllers'."),
]

Algorithm = Annotated[
    str | None, typer.Option(metavar="NAME", show_default="ppo", help="One of 'frobs list algorithms'.")
]

NumEnvs = Annotated[
    int | None, typer.Option(metavar="N", min=1, show_default=False, help="Environments stepped together.")
]

Randomized = Annotated[
    bool,
    typer.Option("--randomized", help="Randomise the models as in the training; else they are the nominal ones."),
]

CheckpointName = Annotated[
    str,
    typer.Option(
        "--checkpoint",
        metavar="WHICH",
        help="newest; best of the evaluations during the training; or its environment steps.",
    ),
]

Seed = Annotated[int | None, typer.Option(metavar="S", min=0, show_default=False, help="Random seed.")]
