"""The table of commands: to add one, write its file and name it here, under the heading of ``--help`` that it suits."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Annotated, Any

import typer

from frobs_core import __version__
from frobs_core.cli import doctor
from frobs_core.cli.bench import bench
from frobs_core.cli.check import check
from frobs_core.cli.compare import compare
from frobs_core.cli.evaluate import evaluate
from frobs_core.cli.export import export
from frobs_core.cli.group import FrobsGroup
from frobs_core.cli.list import list_
from frobs_core.cli.new import new
from frobs_core.cli.parity import parity
from frobs_core.cli.play import play
from frobs_core.cli.plot import plot
from frobs_core.cli.plugins import plugins
from frobs_core.cli.resume import resume
from frobs_core.cli.show import show
from frobs_core.cli.train import train
from frobs_core.cli.tune import tune

COMMANDS: Mapping[str, Mapping[str, Callable[..., Any]]] = {
    "Look around": {"list": list_, "show": show, "plugins": plugins},
    "Learn": {
        "train": train,
        "resume": resume,
        "evaluate": evaluate,
        "play": play,
        "plot": plot,
        "export": export,
        "compare": compare,
        "tune": tune,
    },
    "Extend": {"new": new},
    "Verify": {"check": check, "bench": bench, "parity": parity},
}
"""Heading, then word, then what it does."""

FAMILIES: Mapping[str, Mapping[str, ModuleType]] = {"Verify": {"doctor": doctor}}
"""Heading, then word, then the module of a family of commands: a function of that name, and the table ``COMMANDS``."""


def _help(function: Callable[..., Any]) -> str:
    """Return a docstring as help: paragraphs without line breaks, then the example, a line for each command."""
    *paragraphs, example = (inspect.getdoc(function) or "").split("\n\n")
    lines = "\n".join(line.strip() for line in example.splitlines())
    return "\n\n".join([*(" ".join(paragraph.split()) for paragraph in paragraphs), lines])


def _group() -> typer.Typer:
    return typer.Typer(
        cls=FrobsGroup,
        context_settings={"help_option_names": ["-h", "--help"]},
        rich_markup_mode="rich",
        pretty_exceptions_enable=False,
    )


app = _group()

for _heading, _commands in COMMANDS.items():
    for _word, _function in _commands.items():
        app.command(_word, help=_help(_function), rich_help_panel=_heading)(_function)

for _heading, _families in FAMILIES.items():
    for _word, _module in _families.items():
        _family, _callback = _group(), getattr(_module, _word)
        for _member, _function in _module.COMMANDS.items():
            _family.command(_member, help=_help(_function))(_function)
        _family.callback(invoke_without_command=True, help=_help(_callback))(_callback)
        app.add_typer(_family, name=_word, rich_help_panel=_heading)


def frobs(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an error; also FROBS_DEBUG=1, on any command.")
    ] = False,
) -> None:
    """Robot reinforcement learning from plugins: simulators, robots, controllers, tasks and algorithms.

    Example:
        $ frobs list envs
        $ frobs train frobs/Irb120Reach-v0
        $ frobs COMMAND --help
    """
    if version:
        typer.echo(f"frobs {__version__}")
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())


app.callback(invoke_without_command=True, help=_help(frobs))(frobs)
