"""Functions that commands use to look up installed records and the distributions that provide them."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any

from frobs_cli.commands import command_sources, installed_commands
from frobs_core import __version__, plugins
from frobs_core.description import SENSORS
from frobs_core.plugins import registry
from frobs_core.plugins.capabilities import CAPABILITIES, known_capabilities
from frobs_core.plugins.records import KINDS, ParameterRecord, Record, SensorTypeRecord
from frobs_core.sensing.randomization import physical_parameters
from frobs_core.util.errors import PluginError, UnknownNameError

ENVIRONMENT = "environment"

EXTENSIONS = {
    "capability": "capability",
    "sensor_type": "sensor_type",
    "parameter": "parameter",
    "policy": "policy",
    "viewer": "viewer",
    "command": "",
}
"""Kinds of additions to the contracts and to the program, with the kind of their records."""

_WORDS = {"env": ENVIRONMENT, "envs": ENVIRONMENT, "environments": ENVIRONMENT, ENVIRONMENT: ENVIRONMENT}


@dataclass(frozen=True)
class Listed:
    """A record and the distribution that provides it."""

    name: str  # has the prefix ``distribution:`` if two distributions provide a record with this name
    record: Record
    distribution: str
    version: str

    @property
    def source(self) -> str:
        """Distribution and version."""
        return f"{self.distribution} {self.version}".strip()


def kind_of(word: str) -> str:
    """Return the kind whose singular or plural name is ``word``. ``"environment"`` is considered a kind here.

    Raises:
        UnknownNameError: There is no such kind.
    """
    kinds = (*KINDS, *EXTENSIONS)
    known = {**{kind: kind for kind in kinds}, **{plural(kind): kind for kind in kinds}, **_WORDS}
    known_kind = known.get(word.lower().replace("-", "_"))
    if known_kind is None:
        raise UnknownNameError("kind", word, [*(plural(kind) for kind in kinds), "envs"])
    return known_kind


def plural(kind: str) -> str:
    """Return the plural name of a kind."""
    return f"{kind[:-1]}ies" if kind.endswith("y") else f"{kind}s"


def listed(kind: str) -> list[Listed]:
    """Return the records of a kind, sorted by name. The core's own extensions and all commands have records too."""
    if kind == "command":
        sources = command_sources()
        return [
            Listed(name, Record(name=name, summary=command.summary, entry_point=command.function), *sources[name])
            for name, command in sorted(installed_commands()[0].items())
        ]
    kind = EXTENSIONS.get(kind, kind)
    origins = {
        id(record): (report.distribution, report.version)
        for report in plugins.reports()
        for record in report.records.get(kind, ())
    }
    records = {**plugins.records(kind), **_of_core(kind)}
    return [
        Listed(name, record, *origins.get(id(record), ("frobs-core", __version__) if kind not in KINDS else ("", "")))
        for name, record in sorted(records.items())
    ]


def _of_core(kind: str) -> dict[str, Record]:
    """Return the extensions of the core that plugins cannot override, and a plugin's capabilities with unique names."""
    if kind == "capability":
        return dict(known_capabilities())
    if kind == "sensor_type":
        return {
            cls.type_name: SensorTypeRecord(
                name=cls.type_name,
                summary=inspect.cleandoc(cls.__doc__ or "").partition("\n")[0].replace("``", "").rstrip("."),
                entry_point=f"{cls.__module__}:{cls.__qualname__}",
            )
            for cls in SENSORS
        }
    if kind == "parameter":
        return {
            name: ParameterRecord(name=name, summary=CAPABILITIES[capability], capability=capability)
            for name, capability in physical_parameters().items()
            if name not in plugins.records("parameter")
        }
    return {}


def why_unusable(record: Record) -> str:
    """Return why a record's implementation cannot be imported and how to install it, or ``""`` if the import works."""
    try:
        record.load()
    except PluginError as error:
        return (
            f"the implementation cannot be imported; to install it: {record.install_hint}"
            if record.install_hint
            else str(error)
        )
    return ""


def source_of(kind: str, record: Record) -> str:
    """Return the distribution and version of a record, or an empty string if the record does not come from a plugin.

    Args:
        kind: Name of the record's kind.
        record: The record.
    """
    return next((item.source for item in listed(kind) if item.record is record), "")


def problems() -> list[str]:
    """Return a message for each plugin that failed to load and for each environment ID that is unavailable."""
    return [*plugins.active().failures(), *registry.problems().values()]


def load_command(name: str) -> Any:
    """Import an installed command, and return it as an object of click, or None if the name is that of a group."""
    from frobs_cli.program import LazyCommand

    command = installed_commands()[0][name]
    return LazyCommand(command).loaded if command.function else None
