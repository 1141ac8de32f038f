"""Arguments and options that several commands share, so that their help is the same for every command."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.completion import complete_id

Json = Annotated[bool, typer.Option("--json", help="Print only the results to stdout, in JSON format.")]

EnvId = Annotated[
    str,
    typer.Argument(
        metavar="ID",
        show_default=False,
        help="Gymnasium environment ID: one from 'frobs list envs', or any other ('CartPole-v1', 'module:Id-v0').",
        autocompletion=complete_id,
    ),
]

RunFolder = Annotated[
    Path, typer.Argument(metavar="RUN", show_default=False, help="Run folder written by 'frobs train'.")
]

Robot = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        show_default="the environment's robot",
        help="Robot: a name from 'frobs list robots', or a URDF, xacro or MJCF file.",
    ),
]

Tcp = Annotated[
    str | None,
    typer.Option(
        metavar="LINK", show_default="the robot's TCP", help="Robot link that serves as the tool center point (TCP)."
    ),
]

Base = Annotated[
    str | None,
    typer.Option(
        metavar="KIND",
        show_default="the robot's base",
        help="How the robot's root link can move: fixed, floating or wheeled.",
    ),
]

Simulator = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        show_default="the environment's simulator",
        help="Simulator: a name from 'frobs list simulators'.",
    ),
]

Controller = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        show_default="the environment's controller",
        help="Controller: a name from 'frobs list controllers'.",
    ),
]

Algorithm = Annotated[
    str | None,
    typer.Option(metavar="NAME", show_default="ppo", help="Training algorithm: a name from 'frobs list algorithms'."),
]

NumEnvs = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, show_default=False, help="Number of environments to simulate in parallel."),
]

Randomized = Annotated[
    bool,
    typer.Option(
        "--randomized", help="Apply the randomization used in training. Without this flag, the nominal models are used."
    ),
]

CheckpointName = Annotated[
    str,
    typer.Option(
        "--checkpoint",
        metavar="WHICH",
        help="Checkpoint to use: newest, best (in the evaluations during training), or the number of environment steps "
        "at which it was saved.",
    ),
]

LongestEpisode = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        show_default="the run's setting, 20,000",
        help="Number of steps after which an episode that has not ended is an error. Environments with a time limit are "
        "not affected.",
    ),
]

Seed = Annotated[int | None, typer.Option(metavar="S", min=0, show_default=False, help="Random seed.")]
