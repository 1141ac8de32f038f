"""Declares a distribution's commands in a table of strings, so that listing the commands does not import them.

The entry-point group ``frobs.commands`` names the tables::

    [project.entry-points."frobs.commands"]
    acme-wave = "acme_wave.commands:COMMANDS"

A table is a sequence of :class:`Command` objects. The module that contains the table must not import heavy packages.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

GROUP = "frobs.commands"

HEADINGS = ("Look around", "Learn", "Extend", "Verify", "From plugins")
"""Headings of ``frobs --help``, in display order. All other headings follow these."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command of ``frobs``, or a group of commands.

    Attributes:
        name: Name of the command: one word (``"train"``), or a group name and one word (``"doctor robot"``).
        summary: One line for ``--help``.
        function: Location of the function as ``"module:function"``, or an empty string for a group. The function is
            imported when the command runs or shows its own help.
        heading: Heading in ``frobs --help``.
        loads_plugins: Whether plugins may be loaded while the command runs. For example, ``frobs doctor plugins``
            examines plugins that may hang or crash, so it must not load plugins.
        passes_options_on: Whether options after the command's first argument are passed to a program that the command
            starts.
    """

    name: str
    summary: str
    function: str = ""
    heading: str = "From plugins"
    loads_plugins: bool = True
    passes_options_on: bool = False

    def load(self) -> Any:
        """Import and return the function."""
        module, _, name = self.function.partition(":")
        return getattr(import_module(module), name)


def installed_commands() -> tuple[dict[str, Command], list[str]]:
    """Return all installed commands by name, and an error message for each command table that cannot be read.

    If several distributions declare the same command, ``frobs-cli`` takes precedence over all other distributions.
    Among the other distributions, the first in alphabetical order takes precedence.
    """
    commands: dict[str, Command] = {}
    problems = []
    for entry in sorted(entry_points(group=GROUP), key=_order):
        try:
            table: Sequence[Command] = entry.load()
            for command in table:
                commands.setdefault(command.name, command)
        except Exception as error:
            problems.append(
                f"the commands of {_distribution(entry)} could not be read: {type(error).__name__}: {error}; "
                f"install a version of {_distribution(entry)} that works with this version of frobs-cli, or "
                "uninstall it"
            )
    return commands, problems


def command_sources() -> dict[str, tuple[str, str]]:
    """Return the distribution and the version that provide each installed command, by the command's name."""
    declared, _ = installed_commands()
    sources: dict[str, tuple[str, str]] = {}
    for entry in sorted(entry_points(group=GROUP), key=_order):
        with suppress(Exception):  # installed_commands() reports tables that cannot be read
            table: Sequence[Command] = entry.load()
            for command in table:
                if declared.get(command.name) is command:
                    sources[command.name] = _distribution(entry), entry.dist.version if entry.dist else ""
    return sources


def _order(entry: EntryPoint) -> tuple[bool, str]:
    return _distribution(entry) != "frobs-cli", _distribution(entry)


def _distribution(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist else "an unknown distribution"


COMMANDS = (
    Command(
        name="list",
        summary="List what is installed: parts, environment IDs, extensions of plugins, and commands.",
        function="frobs_cli.list:list_",
        heading="Look around",
    ),
    Command(
        name="show",
        summary="Show the details of a part, an environment ID, an extension, a run or a robot file.",
        function="frobs_cli.show:show",
        heading="Look around",
    ),
    Command(
        name="plugins",
        summary="Show the installed plugins, and why any of them failed to load.",
        function="frobs_cli.plugins:plugins",
        heading="Look around",
    ),
)
"""The commands of this distribution."""
