"""What other distributions add to ``frobs list`` and ``frobs show``: pretrained policies, runs, robot sheets.

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
    """Facts that a distribution knows. Each method may be left out.

    Attributes:
        kind: Name of the things that :meth:`describe` describes, such as ``"run"``; empty: none.
    """

    kind: str = ""

    def environment(self, id: str, record: EnvironmentRecord) -> Mapping[str, Any]:
        """Return further facts about an environment ID, in the types of JSON."""
        return {}

    def column(self, facts: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return heading and cell of a column for ``frobs list envs``; None: no column."""
        return None

    def readable_environment(self, facts: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return facts of :meth:`environment` in a form for people."""
        return facts

    def describes(self, name: str) -> bool:
        """Return whether a name means one of the things of ``kind``."""
        return False

    def describe(self, name: str) -> Mapping[str, Any]:
        """Return the facts about a thing of ``kind``; by default only ``kind`` and ``name``."""
        return {"kind": self.kind, "name": name}

    def readable(self, facts: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return facts of :meth:`describe` in a form for people."""
        return facts

    def draw(self, robot: Robot, picture: Path) -> Path | None:
        """Draw a robot and return the file that was written; None: this provider draws nothing."""
        return None


@cache
def providers() -> tuple[Provider, ...]:
    """Return the installed providers, sorted by name."""
    return tuple(entry.load() for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name))
