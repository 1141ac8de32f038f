"""Finding, loading and listing plugins, so that none of them can hurt the others.

    discovery.py    reads the entry points of the installed distributions; imports nothing
    loading.py      imports one plugin, calls its hooks, checks its records
    known.py        which distribution of this project offers which names
    report.py       what became of it
    requirements.py what a distribution says that it needs, the versions of the core among it
    probe.py        imports one in a process of its own (child.py), with a time limit
    collection.py   guards each of them, keeps the reports, and looks names up

The functions below ask one collection, that of everything installed. :func:`isolated` puts another in its place.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress

from frobs_core.errors import PluginError
from frobs_core.plugins.collection import Plugins
from frobs_core.plugins.discovery import Candidate, normalize
from frobs_core.plugins.known import install_command
from frobs_core.plugins.probe import Probe, probe
from frobs_core.plugins.report import PluginReport
from frobs_core.plugins.requirements import core_versions, has_upper_bound, is_made_for, missing
from frobs_core.specs import Record

__all__ = [
    "Candidate",
    "PluginReport",
    "Plugins",
    "Probe",
    "active",
    "core_versions",
    "get_record",
    "get_report",
    "has_upper_bound",
    "importable",
    "install_command",
    "is_made_for",
    "isolated",
    "missing",
    "normalize",
    "probe",
    "records",
    "reports",
]

_active = Plugins()


def active() -> Plugins:
    """Return the collection that the functions of this module ask."""
    return _active


@contextmanager
def isolated(plugins: Plugins) -> Iterator[Plugins]:
    """Put another collection in the place of the installed one, for the length of a ``with`` block."""
    global _active
    before, _active = _active, plugins
    try:
        yield plugins
    finally:
        _active = before


def reports() -> tuple[PluginReport, ...]:
    """Return what became of each plugin; loads them on the first call."""
    return _active.reports()


def records(kind: str) -> Mapping[str, Record]:
    """Return the records of a kind by name; names that two distributions offer are ``"distribution:name"``.

    Raises:
        UnknownNameError: There is no such kind.
    """
    return _active.records(kind)


def importable(kind: str) -> list[str]:
    """Return the names of the records of a kind whose implementation can be imported here: its engine is installed.

    Raises:
        UnknownNameError: There is no such kind.
    """
    found = []
    for name, record in records(kind).items():
        with suppress(PluginError):
            record.load()
            found.append(name)
    return found


def get_record(kind: str, name: str) -> Record:
    """Return one record by its name or its ``"distribution:name"``.

    Raises:
        UnknownNameError: Nothing of the kind has this name.
        AmbiguousNameError: Two distributions offer the name.
    """
    return _active.get_record(kind, name)


def get_report(kind: str, name: str) -> PluginReport:
    """Return the report of the plugin that offers a record; the arguments and errors of :func:`get_record`."""
    return _active.get_report(kind, name)
