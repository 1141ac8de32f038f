"""``frobs ros``: what has to do with ROS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import typer

from frobs_ros.cli.link import link
from frobs_ros.cli.serve import serve


def ros(context: typer.Context) -> None:
    """Work with ROS 1: its modules in a virtual environment, and simulations behind the names of Gazebo.

    Example:
        $ frobs ros link
        $ frobs ros serve --robot irb120 --simulator mujoco
        $ frobs ros COMMAND --help
    """
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


COMMANDS: Mapping[str, Callable[..., Any]] = {"link": link, "serve": serve}
"""Word, then what it does."""
