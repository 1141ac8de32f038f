"""``frobs doctor``: what is wrong, and what to do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import typer

from frobs_core.cli.doctor_plugins import plugins
from frobs_core.cli.doctor_robot import robot


def doctor(context: typer.Context) -> None:
    """Find out what is wrong with a robot's file or with the installed plugins, and what to do.

    Example:
        $ frobs doctor robot arm.urdf
        $ frobs doctor plugins
        $ frobs doctor COMMAND --help
    """
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


COMMANDS: Mapping[str, Callable[..., Any]] = {"plugins": plugins, "robot": robot}
"""Word, then what it examines."""
