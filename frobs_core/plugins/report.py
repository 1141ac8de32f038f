"""The result of loading one plugin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from frobs_core.plugins.discovery import Candidate
from frobs_core.plugins.records import RECORDS, Record, TaskRecord

_NO_RECORDS: Mapping[str, tuple[Record, ...]] = MappingProxyType(dict.fromkeys(RECORDS, ()))


@dataclass(frozen=True)
class PluginReport:
    """The result of loading one plugin.

    Attributes:
        name: The entry point's name.
        distribution: Name of the pip package that contains the entry point.
        version: Version of the distribution.
        module: Module that the entry point names.
        state: ``"loaded"``, ``"failed"`` or ``"disabled"``.
        cause: One-line reason why the plugin is not loaded.
        traceback: Traceback of the failure.
        import_seconds: Duration of the plugin's import [s].
        records: The plugin's records, by kind. The mapping contains all kinds.
        made_for: Versions of the core that the distribution requires, such as ``">=0.3,<0.4"``, or empty if not
            specified.
        warning: One-line description of a non-fatal problem with a loaded plugin, or empty if there is no problem.
    """

    name: str
    distribution: str
    version: str
    module: str
    state: str
    cause: str = ""
    traceback: str = ""
    import_seconds: float = 0.0
    records: Mapping[str, tuple[Record, ...]] = field(default_factory=lambda: _NO_RECORDS)
    made_for: str = ""
    warning: str = ""

    @property
    def origin(self) -> str:
        """The distribution with its version, such as ``"frobs-robots-abb 0.1.0"``."""
        return f"{self.distribution} {self.version}"

    @property
    def environment_ids(self) -> tuple[str, ...]:
        """The Gymnasium IDs of the plugin's tasks."""
        return environment_ids(self.records)

    @classmethod
    def of(cls, candidate: Candidate, state: str, **fields: Any) -> PluginReport:
        """Return the report for an entry point. The keywords are the other fields of the report."""
        return cls(candidate.name, candidate.distribution, candidate.version, candidate.value, state, **fields)


def environment_ids(records: Mapping[str, tuple[Record, ...]]) -> tuple[str, ...]:
    """Return the Gymnasium IDs of all tasks in the given records."""
    return tuple(e.id for task in records["task"] if isinstance(task, TaskRecord) for e in task.environments)
