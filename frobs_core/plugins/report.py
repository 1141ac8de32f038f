"""The result of loading one plugin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from frobs_core.plugins.discovery import Candidate
from frobs_core.plugins.records import RECORDS, Record, TaskRecord

_NO_RECORDS: Mapping[str, tuple[Record, ...]] = MappingProxyType(dict.fromkeys(RECORDS, ()))


@dataclass(frozen=True, kw_only=True)
class PluginReport(Candidate):
    """The result of loading one plugin, in addition to its :class:`Candidate`.

    Attributes:
        state: ``"loaded"``, ``"failed"`` or ``"disabled"``.
        cause: One-line reason why the plugin is not loaded.
        traceback: Traceback of the failure.
        import_seconds: Duration of the plugin's import [s].
        records: The plugin's records, by kind. The mapping contains all kinds.
        warning: One-line description of a non-fatal problem with a loaded plugin, or empty if there is no problem.
    """

    state: str
    cause: str = ""
    traceback: str = ""
    import_seconds: float = 0.0
    records: Mapping[str, tuple[Record, ...]] = field(default_factory=lambda: _NO_RECORDS)
    warning: str = ""

    @property
    def module(self) -> str:
        """Module that the entry point names."""
        return self.value

    @property
    def environment_ids(self) -> tuple[str, ...]:
        """The Gymnasium IDs of the plugin's tasks."""
        return environment_ids(self.records)


def record_names(records: Mapping[str, Sequence[Record]]) -> list[str]:
    """Return a text for each name that must be unique, such as ``"robot 'irb120'"``, including environment IDs."""
    names = [f"{kind} '{record.name}'" for kind, offered in records.items() for record in offered]
    return names + [f"environment ID '{id}'" for id in environment_ids(records)]


def environment_ids(records: Mapping[str, Sequence[Record]]) -> tuple[str, ...]:
    """Return the Gymnasium IDs of all tasks in the given records."""
    return tuple(e.id for task in records["task"] if isinstance(task, TaskRecord) for e in task.environments)
