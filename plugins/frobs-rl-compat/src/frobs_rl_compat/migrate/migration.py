"""Migration report, which lists the parts that were migrated and the parts that were not."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class Migration:
    """Result of a migration.

    Attributes:
        path: The created folder or file.
        carried: Migrated parts and their new locations.
        differs: Parts that behave differently, each with a description of the difference.
        left: Parts that were not migrated, each with advice.
        next: Commands for the next steps.
    """

    name: str
    path: Path
    carried: list[tuple[str, str]] = field(default_factory=list)
    differs: list[tuple[str, str]] = field(default_factory=list)
    left: list[tuple[str, str]] = field(default_factory=list)
    next: list[str] = field(default_factory=list)

    def carry(self, what: str, where: str) -> None:
        """Record a migrated part."""
        self.carried.append((what, where))

    def differ(self, what: str, how: str) -> None:
        """Record a part that behaves differently."""
        self.differs.append((what, how))

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
            **({"differs": [{"what": what, "how": how} for what, how in self.differs]} if self.differs else {}),
            "left to do": [{"what": what, "advice": advice} for what, advice in self.left],
            "next": self.next,
        }

    def markdown(self) -> str:
        """Return the report as a Markdown page."""
        lines = [f"# {self.name}: what `frobs migrate` did", "", "## Carried over", "", "| what | where |", "|---|---|"]
        lines += [f"| {_cell(what)} | {_cell(where)} |" for what, where in self.carried]
        if self.differs:
            lines += ["", "## Different", "", "| what | how |", "|---|---|"]
            lines += [f"| {_cell(what)} | {_cell(how)} |" for what, how in self.differs]
        lines += ["", "## Left to do", "", "| what | what to do |", "|---|---|"]
        lines += [f"| {_cell(what)} | {_cell(advice)} |" for what, advice in self.left]
        lines += ["", "`TODO` comments in the files mark the places that you have to edit.", ""]
        return "\n".join(lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
