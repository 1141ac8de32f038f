"""Migration report, which lists the parts that were migrated and the parts that were not."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from frobs_core.util.errors import ConfigurationError
from frobs_core.util.yaml import load_yaml

COUNTERPARTS = load_yaml(Path(__file__).with_name("counterparts.yaml"))
"""Equivalents in FRobs of the parts of a FRobs_RL package: controllers, spaces, hooks and examples."""


class MigrationError(ConfigurationError):
    """A file or folder cannot be migrated, for a reason that also states the solution."""

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"{path}: {reason}")


@dataclass
class Migration:
    """Result of a migration."""

    name: str
    path: Path
    carried: list[tuple[str, str]] = field(default_factory=list)
    left: list[tuple[str, str]] = field(default_factory=list)
    next: list[str] = field(default_factory=list)

    def carry(self, what: str, where: str) -> None:
        """Record a migrated part."""
        self.carried.append((what, where))

    def leave(self, what: str, advice: str) -> None:
        """Record a part that was not migrated."""
        self.left.append((what, advice))

    def facts(self) -> dict[str, Any]:
        """Return the report as a dictionary that the command line can print as JSON."""
        return {
            "kind": "migration",
            "name": self.name,
            "made": str(self.path),
            "carried": [{"what": what, "where": where} for what, where in self.carried],
            "left to do": [{"what": what, "advice": advice} for what, advice in self.left],
            "next": self.next,
        }

    def markdown(self) -> str:
        """Return the report as a Markdown page."""
        lines = [f"# {self.name}: what `frobs migrate` did", "", "## Carried over", "", "| what | where |", "|---|---|"]
        lines += [f"| {_cell(what)} | {_cell(where)} |" for what, where in self.carried]
        lines += ["", "## Left to do", "", "| what | what to do |", "|---|---|"]
        lines += [f"| {_cell(what)} | {_cell(advice)} |" for what, advice in self.left]
        lines += ["", "`TODO` comments in the files mark the places that you have to edit.", ""]
        return "\n".join(lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
