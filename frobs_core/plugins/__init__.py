"""Discovery, loading and listing of plugins. A broken plugin does not affect other plugins.

- ``discovery`` reads the entry points of the installed distributions, and which versions of the core they support,
  without importing anything.
- ``loading`` imports one plugin, calls its hooks, and validates its records.
- ``report`` contains the result of loading a plugin.
- ``collection`` loads plugins in isolation, stores the reports, and looks up names. It knows which distribution of this
  project provides which name.

The functions of this module use the collection of all installed plugins, which :func:`isolated` temporarily replaces.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, overload

from frobs_core.deprecation import moved_names
from frobs_core.plugins.collection import Plugins, install_command
from frobs_core.plugins.discovery import Candidate, core_versions, is_made_for, normalize
from frobs_core.plugins.loading import import_plugin, read_records
from frobs_core.plugins.report import PluginReport, environment_ids
from frobs_core.util.errors import PluginError

if TYPE_CHECKING:
    from frobs_core.plugins.records import AnyRecord, Record

__getattr__ = moved_names(__name__)

__all__ = [
    "Candidate",
    "PluginReport",
    "Plugins",
    "active",
    "core_versions",
    "engines",
    "environment_ids",
    "get_record",
    "get_report",
    "import_plugin",
    "importable",
    "install_command",
    "is_made_for",
    "isolated",
    "normalize",
    "read_records",
    "records",
    "reports",
]

_active = Plugins()


def active() -> Plugins:
    """Return the collection that the functions of this module use."""
    return _active


@contextmanager
def isolated(plugins: Plugins) -> Iterator[Plugins]:
    """Replace the collection of installed plugins inside a ``with`` block."""
    global _active
    before, _active = _active, plugins
    try:
        yield plugins
    finally:
        _active = before


def reports() -> tuple[PluginReport, ...]:
    """Return the report of each plugin. The first call loads the plugins."""
    return _active.reports()


@overload
def records(kind: str) -> Mapping[str, Record]: ...
@overload
def records(kind: type[AnyRecord]) -> Mapping[str, AnyRecord]: ...
def records(kind: str | type[Record]) -> Mapping[str, Record]:
    """Return the records of a kind by name, or by ``"distribution:name"`` if two distributions provide the same name.

    Args:
        kind: Name of the kind, or the class of its records.

    Raises:
        UnknownNameError: The named kind does not exist.
    """
    return _active.records(kind)


def importable(kind: str) -> list[str]:
    """Return the names of importable records of a kind, such as simulators whose engine is installed."""
    found = []
    for name, record in records(kind).items():
        with suppress(PluginError):
            record.load()
            found.append(name)
    return found


def engines() -> list[str]:
    """Return the names of importable simulators that are not paced: they need no robot and no running world."""
    return [name for name in importable("simulator") if not getattr(get_record("simulator", name), "is_paced", False)]


def get_record(kind: str, name: str) -> Record:
    """Return the record with a given name or ``"distribution:name"``.

    Args:
        kind: Name of the kind.
        name: Name of the record.

    Raises:
        UnknownNameError: No record of this kind has the given name.
        AmbiguousNameError: Two distributions provide the name.
    """
    return _active.get_record(kind, name)


def get_report(kind: str, name: str) -> PluginReport:
    """Return the report of the plugin that provides a record. See :func:`get_record` for arguments and errors."""
    return _active.get_report(kind, name)
