"""Commands that other distributions add: entry points of the group ``frobs.commands``.

The name is the word, ``migrate``, or two of them with a dot between, ``doctor.ros``. The object is a function, or for a
family of commands a module: a function of the family's name, and the table ``COMMANDS``. It is imported whenever the
command line starts, so it imports what is heavy inside of its functions::

    [project.entry-points."frobs.commands"]
    ros = "frobs_ros.cli.ros"
    "doctor.ros" = "frobs_ros.cli.doctor_ros:ros"
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from types import ModuleType
from typing import Any

from frobs_core.errors import PluginError

GROUP = "frobs.commands"
HEADING = "From plugins"


@dataclass(frozen=True)
class Extension:
    """A command that another distribution adds.

    Attributes:
        words: One word, or a family and its member.
        target: The function, or the module of a family.
        broken: Whether it could not be imported; the function then says why.
    """

    words: tuple[str, ...]
    target: Callable[..., Any] | ModuleType
    broken: bool = False


def extensions() -> list[Extension]:
    """Return what is installed, by name; where two distributions add one word, it is the first's by name."""
    found: dict[tuple[str, ...], Extension] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, _distribution(entry))):
        words = tuple(entry.name.split("."))
        if words not in found:
            found[words] = _load(entry, words)
    return list(found.values())


def _load(entry: EntryPoint, words: tuple[str, ...]) -> Extension:
    try:
        return Extension(words, entry.load())
    except Exception as error:
        distribution = _distribution(entry)
        text = (
            f"the command '{' '.join(words)}' of {distribution} could not be imported: {type(error).__name__}: {error}. "
            f"Install a version of {distribution} that suits this frobs-core, or uninstall it."
        )

    def refuse() -> None:
        raise PluginError(text)

    return Extension(words, refuse, broken=True)


def _distribution(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist else "an unknown distribution"
