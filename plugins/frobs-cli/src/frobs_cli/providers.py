"""Lets other distributions extend ``frobs list`` and ``frobs show``, for example with pretrained policies and runs.

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
    from frobs_core.description import Robot
    from frobs_core.plugins.records import EnvironmentRecord

GROUP = "frobs.providers"


class Provider:
    """A distribution's source of additional facts. Overriding the methods is optional.

    Attributes:
        kind: Kind of object that :meth:`describe` describes, such as ``"run"``, or an empty string if the provider
            does not describe objects.
    """

    kind: str = ""

    def environment(self, id: str, record: EnvironmentRecord) -> Mapping[str, Any]:
        """Return additional facts about an environment ID. All values must have JSON-compatible types."""
        return {}

    def column(self, facts: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return the heading and cell text of an additional column in ``frobs list envs``, or None for no column.

        Args:
            facts: Facts about the environment of the row.
        """
        return None

    def readable_environment(self, facts: Mapping[str, Any]) -> Mapping[str, Any]:
        """Convert the facts from :meth:`environment` to human-readable form."""
        return facts

    def describes(self, name: str) -> bool:
        """Return whether a name refers to an object of ``kind``."""
        return False

    def describe(self, name: str) -> Mapping[str, Any]:
        """Return the facts about an object of ``kind``. By default, only ``kind`` and ``name`` are returned."""
        return {"kind": self.kind, "name": name}

    def readable(self, facts: Mapping[str, Any]) -> Mapping[str, Any]:
        """Convert the facts from :meth:`describe` to human-readable form."""
        return facts

    def draw(self, robot: Robot, picture: Path) -> Path | None:
        """Draw a robot and return the path of the picture, or None if this provider does not draw robots."""
        return None

    def draw_cameras(self, id: str, keywords: Mapping[str, Any], picture: Path) -> Path | None:
        """Draw what the cameras of an environment see, and return the path of the picture, or None as above.

        Args:
            id: Environment ID.
            keywords: Keywords of the environment.
            picture: PNG file to write.
        """
        return None


@cache
def providers() -> tuple[Provider, ...]:
    """Return the installed providers, sorted by name."""
    return tuple(entry.load() for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name))
