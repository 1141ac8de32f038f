"""Finding, loading and listing plugins, so that none of them can hurt the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from frobs_core.specs import Record


@dataclass(frozen=True)
class PluginReport:
    """What became of one plugin.

    Attributes:
        name: The entry point's name.
        distribution: The pip package that holds it.
        version: Of the distribution.
        module: That the entry point names.
        state: ``"loaded"``, ``"failed"`` or ``"disabled"``.
        cause: One line that says why it is not loaded.
        traceback: Of the failure.
        import_seconds: How long its import took.
        records: Its records, by kind.
    """

    name: str
    distribution: str
    version: str
    module: str
    state: str
    cause: str
    traceback: str
    import_seconds: float
    records: Mapping[str, tuple[Record, ...]]


def reports() -> tuple[PluginReport, ...]:
    """Return what became of each plugin; loads them on the first call."""
    raise NotImplementedError


def records(kind: str) -> Mapping[str, Record]:
    """Return the records of a kind by name; names that two distributions offer are ``"distribution:name"``."""
    raise NotImplementedError


def get_record(kind: str, name: str) -> Record:
    """Return one record.

    Raises:
        UnknownNameError: Nothing of the kind has this name.
        AmbiguousNameError: Two distributions offer the name.
    """
    raise NotImplementedError
