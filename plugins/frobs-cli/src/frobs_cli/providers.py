"""Additions of other distributions to ``frobs list`` and ``frobs show``: pretrained policies, runs, robot sheets.

The entry-point group ``frobs.providers`` names instances of :class:`Provider`::

    [project.entry-points."frobs.providers"]
    frobs-train = "frobs_train.cli.provider:PROVIDER"
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from frobs_core.interfaces import Robot
    from frobs_core.specs import EnvironmentRecord

GROUP = "frobs.providers"


class Provider:
    """Additional facts from a distribution. All methods are optional.

    Attributes:
        kind: Kind of object that :meth:`describe` describes, such as ``"run"``; empty: none.
    """

    kind: str = ""

    def environment(self, id: str, record: EnvironmentRecord) -> Mapping[str, Any]:
        """Return additional facts about an environment ID, as JSON types."""
        return {}

    def column(self, facts: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return the heading and cell of an additional column for ``frobs list envs``; None: no column."""
        return None

    def readable_environment(self, facts: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return facts of :meth:`environment` in human-readable form."""
        return facts

    def describes(self, name: str) -> bool:
        """Return whether a name refers to an object of ``kind``."""
        return False

    def describe(self, name: str) -> Mapping[str, Any]:
        """Return the facts about an object of ``kind``; by default only ``kind`` and ``name``."""
        return {"kind": self.kind, "name": name}

    def readable(self, facts: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return facts of :meth:`describe` in human-readable form."""
        return facts

    def draw(self, robot: Robot, picture: Path) -> Path | None:
        """Draw a robot and return the written file; None if this provider does not draw."""
        return None


@cache
def providers() -> tuple[Provider, ...]:
    """Return the installed providers, sorted by name."""
    return tuple(entry.load() for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name))
