"""Builds the program from the installed command tables. A command's module is imported when the command runs."""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from frobs_cli.commands import HEADINGS, Command, installed_commands
from frobs_cli.field_options import with_options
from frobs_cli.group import FrobsCommand, FrobsGroup
from frobs_cli.output import print_note

_SETTINGS = {"help_option_names": ["-h", "--help"]}


class LazyCommand(TyperCommand):
    """A command whose function is imported only to run the command, complete its options or show its help."""

    def __init__(self, record: Command) -> None:
        super().__init__(record.name.split()[-1], help=record.summary, rich_help_panel=record.heading)
        self.record = record

    @cached_property
    def loaded(self) -> TyperCommand:
        """The imported command with its parameters.

        Raises:
            CommandImportError: The command's function cannot be imported.
        """
        try:
            function = self.record.load()
        except Exception as error:
            raise CommandImportError(self.record, error) from error
        settings = {**_SETTINGS, "allow_interspersed_args": not self.record.passes_options_on}
        app = typer.Typer(add_completion=False, rich_markup_mode="rich")
        app.command(self.name, cls=FrobsCommand, help=help_text(function), context_settings=settings)(
            with_options(function)
        )
        command = typer.main.get_command(app)
        assert isinstance(command, TyperCommand)
        return command

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Import the command and parse its arguments."""
        if not self.record.loads_plugins and "frobs_core" not in sys.modules:  # importing the core loads plugins
            os.environ["FROBS_NO_PLUGINS"] = "1"
        return self.loaded.make_context(info_name, args, parent=parent, **extra)


class CommandImportError(typer.TyperException):
    """Error that is raised if a command's function cannot be imported."""

    def __init__(self, record: Command, error: Exception) -> None:
        super().__init__(
            f"the command '{record.name}' could not be imported from '{record.function}': "
            f"{type(error).__name__}: {error}"
        )


def program() -> typer.Typer:
    """Return the program with the commands of all installed distributions."""
    app = _typer()
    app.callback(invoke_without_command=True, help=help_text(frobs))(frobs)
    return app


def walk() -> Iterator[tuple[str, Any]]:
    """Yield the full name and the imported command for the program and each of its commands."""
    yield from _walk("frobs", typer.main.get_command(program()))


def help_text(function: Callable[..., Any]) -> str:
    """Return a function's docstring as help text: paragraphs without line breaks, then one line for each example."""
    *paragraphs, example = (inspect.getdoc(function) or "").split("\n\n")
    lines = "\n".join(line.strip() for line in example.splitlines())
    return "\n\n".join([*(" ".join(paragraph.split()) for paragraph in paragraphs), lines])


class _Program(FrobsGroup):
    """The top-level group, which lists its commands by heading."""

    def __init__(self, *args: Any, **keywords: Any) -> None:
        super().__init__(*args, **keywords)
        records, self._problems = installed_commands()
        self._passing_on = [record.name.split() for record in records.values() if record.passes_options_on]
        order = {heading: i for i, heading in enumerate(HEADINGS)}
        for record in sorted(
            records.values(), key=lambda record: (record.name.count(" "), order.get(record.heading, len(order)))
        ):  # groups before their members
            group, _, _ = record.name.rpartition(" ")
            home: TyperGroup | None = self if not group else self._subgroup(group)
            if home is not None and not record.function:
                home.add_command(_group(record))
            elif home is not None:
                home.add_command(LazyCommand(record))

    def _subgroup(self, name: str) -> TyperGroup | None:
        command = self.commands.get(name)
        return command if isinstance(command, TyperGroup) else None

    def passes_options_on(self, args: Sequence[str]) -> bool:
        return any(list(args[: len(words)]) == words for words in self._passing_on)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help, and report command tables that cannot be read."""
        for line in self._problems:
            print_note(line)
        super().format_help(ctx, formatter)


def _typer() -> typer.Typer:
    return typer.Typer(
        cls=_Program, context_settings=_SETTINGS, rich_markup_mode="rich", pretty_exceptions_enable=False
    )


def _group(record: Command) -> TyperGroup:
    def show_help(context: typer.Context) -> None:
        if context.invoked_subcommand is None:
            typer.echo(context.get_help())

    app = typer.Typer(cls=FrobsGroup, add_completion=False, context_settings=_SETTINGS, rich_markup_mode="rich")
    text = f"{record.summary}\n\nExample:\n$ frobs {record.name} COMMAND --help"
    app.callback(invoke_without_command=True, help=text)(show_help)
    group = typer.main.get_group(app)
    group.name, group.rich_help_panel = record.name, record.heading
    return group


def _walk(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    yield name, command.loaded if isinstance(command, LazyCommand) else command
    children: Mapping[str, Any] = getattr(command, "commands", {})
    for word, child in children.items():
        yield from _walk(f"{name} {word}", child)


def frobs(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
    debug: Annotated[
        bool,
        typer.Option(
            "--debug",
            help="Show the traceback of an error. Every command accepts this flag; FROBS_DEBUG=1 has the same effect.",
        ),
    ] = False,
) -> None:
    """Robot reinforcement learning with plugins for simulators, robots, controllers, tasks and algorithms.

    Example:
        $ frobs list envs
        $ frobs train frobs/Irb120Reach-v0
        $ frobs COMMAND --help
    """
    if version:
        from importlib.metadata import version as version_of

        typer.echo(f"frobs {version_of('frobs-core')}")
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())
