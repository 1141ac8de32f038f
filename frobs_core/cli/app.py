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
from frobs_core.cli.extensions import HEADING, Extension, extensions
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


def _family(word: str, module: ModuleType) -> typer.Typer:
    family, callback = _group(), getattr(module, word)
    for member, function in module.COMMANDS.items():
        settings = getattr(function, "context_settings", None)  # of Click, for a command that parses in its own way
        family.command(member, help=_help(function), context_settings=settings)(function)
    family.callback(invoke_without_command=True, help=_help(callback))(callback)
    return family


def _extend(extension: Extension) -> None:
    """Add another distribution's command, unless the word is taken or its family is unknown."""
    *path, word = extension.words
    home, heading = (app, HEADING) if not path else (_families.get(".".join(path)), None)
    if home is None or word in _taken(home):
        return
    target = extension.target
    if isinstance(target, ModuleType):
        home.add_typer(_family(word, target), name=word, rich_help_panel=heading)
    elif extension.broken:
        text = f"This command could not be imported.\n\nExample:\n$ {' '.join(('frobs', *extension.words))}"
        anything = {"ignore_unknown_options": True, "allow_extra_args": True}
        home.command(word, help=text, rich_help_panel=heading, context_settings=anything)(target)
    else:
        home.command(word, help=_help(target), rich_help_panel=heading)(target)


def _taken(home: typer.Typer) -> set[str | None]:
    return {command.name for command in home.registered_commands} | {group.name for group in home.registered_groups}


app = _group()
_families: dict[str, typer.Typer] = {}

for _heading, _commands in COMMANDS.items():
    for _word, _function in _commands.items():
        app.command(_word, help=_help(_function), rich_help_panel=_heading)(_function)

for _heading, _modules in FAMILIES.items():
    for _word, _module in _modules.items():
        _families[_word] = _family(_word, _module)
        app.add_typer(_families[_word], name=_word, rich_help_panel=_heading)

for _extension in extensions():
    _extend(_extension)


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
