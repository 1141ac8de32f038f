"""The command ``frobs legacy``, which runs packages written for FRobs_RL."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from typing import Annotated

import typer

from frobs_core.util.errors import ConfigurationError


def run(
    command: Annotated[
        list[str],
        typer.Argument(
            metavar="SCRIPT", show_default=False, help="Python script (*.py) or any program, followed by its arguments."
        ),
    ],
) -> None:
    """Run a script or program from a package that was written for FRobs_RL.

    The script and all processes that it starts can import gym, frobs_rl, rospy and ROS messages, and rospack finds the
    ROS package frobs_rl. Python scripts run with the Python interpreter that runs frobs. The command exits with the
    script's exit code.

    Example:
        $ frobs legacy run scripts/train.py --seed 3
        $ frobs legacy run roslaunch my_arm_rl train.launch
    """
    from frobs_rl_compat.legacy import legacy_variables

    words = [sys.executable, *command] if command[0].endswith(".py") else command
    environment = {**os.environ, **legacy_variables()}
    program = shutil.which(words[0], path=environment["PATH"])
    if program is None:
        raise ConfigurationError(
            f"'{words[0]}' is neither a Python script (*.py) nor an installed program; check the path, or install the "
            "program."
        )
    # Replace this process, so that the script receives Ctrl-C and all other signals directly.
    os.execve(program, words, environment)


def env() -> None:
    """Print the environment variables that 'frobs legacy run' sets, as export commands for a shell.

    Example:
        $ eval "$(frobs legacy env)"
        $ frobs legacy env
    """
    from frobs_rl_compat.legacy import legacy_variables

    for name, value in legacy_variables().items():
        typer.echo(f"export {name}={shlex.quote(value)}")
