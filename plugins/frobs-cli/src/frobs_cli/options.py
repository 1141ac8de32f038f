"""Arguments and options that several commands share, so that their help is the same for every command."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

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


def _name(default: str, help: str, metavar: str = "NAME") -> Any:
    """Return an option that, if omitted, has the value that ``default`` describes."""
    return typer.Option(metavar=metavar, show_default=default, help=help)


Robot = Annotated[
    str | None,
    _name(
        "the environment's robot",
        "Robot: a name from 'frobs list robots', a URDF, xacro or MJCF file, or a YAML file that 'frobs doctor robot "
        "--write' wrote.",
    ),
]
Tcp = Annotated[
    str | None, _name("the robot's TCP", "Robot link that serves as the tool center point (TCP).", metavar="LINK")
]
Gripper = Annotated[
    str | None,
    _name(
        "found in the file",
        "Joints that move the fingers of a model file's gripper, separated by commas.",
        metavar="JOINT[,JOINT]",
    ),
]
Attach = Annotated[
    str | None,
    _name(
        "nothing",
        "Gripper to mount on the arm: a name from 'frobs list robots', or a model file. It is mounted on LINK, which "
        "defaults to the arm's tool center point or last link.",
        metavar="GRIPPER[@LINK]",
    ),
]
Simulator = Annotated[
    str | None, _name("the environment's simulator", "Simulator: a name from 'frobs list simulators'.")
]
Controller = Annotated[
    str | None, _name("the environment's controller", "Controller: a name from 'frobs list controllers'.")
]

NumEnvs = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="Number of environments to simulate in parallel."),
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
        help="Raise an error if an episode has not ended after this number of steps. Environments with a time limit are not "
        "affected.",
    ),
]

Seed = Annotated[int | None, typer.Option(metavar="S", min=0, help="Random seed.")]
