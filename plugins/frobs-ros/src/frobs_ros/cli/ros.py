"""``frobs ros``: what has to do with ROS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import typer

from frobs_ros.cli.run import run
from frobs_ros.cli.serve import serve


def ros(context: typer.Context) -> None:
    """Work with ROS 1: any simulation with Gazebo's topics and services, trained policies as nodes.

    Example:
        $ frobs ros serve --robot irb120 --simulator mujoco
        $ frobs ros run reach.frobs --controller arm_controller
        $ frobs ros COMMAND --help
    """
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


COMMANDS: Mapping[str, Callable[..., Any]] = {"run": run, "serve": serve}
"""Word, then what it does."""
