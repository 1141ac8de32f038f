"""What was carried over, and what was not."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class Migration:
    """What a migration has made.

    Attributes:
        path: The folder or file that was made.
        carried: What was carried over, and where it is now.
        differs: What works in another way than before, and how.
        left: What was not carried over, and what to do.
        next: Commands to go on with.
    """

    name: str
    path: Path
    carried: list[tuple[str, str]] = field(default_factory=list)
    differs: list[tuple[str, str]] = field(default_factory=list)
    left: list[tuple[str, str]] = field(default_factory=list)
    next: list[str] = field(default_factory=list)

    def carry(self, what: str, where: str) -> None:
        """Note what was carried over."""
        self.carried.append((what, where))

    def differ(self, what: str, how: str) -> None:
        """Note what works in another way."""
        self.differs.append((what, how))

    def leave(self, what: str, advice: str) -> None:
        """Note what was not."""
        self.left.append((what, advice))

    def facts(self) -> dict[str, Any]:
        """Return all of it, as the command line shows it."""
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
        """Return it as a page."""
        lines = [f"# {self.name}: what `frobs migrate` did", "", "## Carried over", "", "| what | where |", "|---|---|"]
        lines += [f"| {_cell(what)} | {_cell(where)} |" for what, where in self.carried]
        if self.differs:
            lines += ["", "## Different", "", "| what | how |", "|---|---|"]
            lines += [f"| {_cell(what)} | {_cell(how)} |" for what, how in self.differs]
        lines += ["", "## Left to do", "", "| what | what to do |", "|---|---|"]
        lines += [f"| {_cell(what)} | {_cell(advice)} |" for what, advice in self.left]
        lines += ["", "The places in the files are marked `TODO`.", ""]
        return "\n".join(lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
