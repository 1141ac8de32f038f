"""The pages that people read, and the fenced blocks in them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
    + [path for path in DOCS.rglob("*.md") if "generated" not in path.parts]
)
RUN = ("bash", "python")
"""Languages of the blocks that are run; ``yaml`` with a file name is written to that file."""

_FENCE = re.compile(r"^(`{3,}|:{3,})\s*(.*)$")
_ATTRIBUTE = re.compile(r'(\w+)="([^"]*)"')


@dataclass(frozen=True)
class Block:
    """A fenced block: where it stands, its language, what stands behind the language, and its text."""

    page: Path
    line: int
    language: str
    attributes: dict[str, str]
    text: str


def blocks(page: Path) -> Iterator[Block]:
    """Yield the fenced blocks of a page."""
    lines = iter(enumerate(page.read_text("utf-8").splitlines(), 1))
    for number, line in lines:
        fence = _FENCE.match(line)
        if not fence or fence[1].startswith(":"):
            continue
        body = []
        for _, inner in lines:
            if inner.startswith(fence[1]):
                break
            body.append(inner)
        language, _, rest = fence[2].partition(" ")
        yield Block(page, number, language, dict(_ATTRIBUTE.findall(rest)), "\n".join(body) + "\n")


def name(page: Path) -> str:
    """Return the name of a page for test ids."""
    return page.relative_to(ROOT).as_posix()
