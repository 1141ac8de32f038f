"""The figure of the layers, drawn from the imports between the distributions."""

from collections import defaultdict
from dataclasses import dataclass
from html import escape

from layers import distributions, imported_distributions

_WIDTH, _HEIGHT = 104, 66
_COLUMN, _ROW, _MARGIN = 112, 104, 20
_TITLE = "Distributions of FRobs in layers; an arrow points from a distribution to one that it imports"

_KINDS = {
    "frobs-sim-": "simulators",
    "frobs-robots-": "robots",
    "frobs-tasks-": "tasks",
    "frobs-controllers": "controllers",
    "frobs-algos-": "algorithms",
}
"""Plugins of a kind, by the beginning of their names."""

_COLUMNS = {
    "frobs-deploy": 0,
    "frobs-train": 0,
    "frobs-devkit": 0,
    "frobs-data": 1,
    "frobs-view": 0,
    "frobs-ros": 1,
    "frobs-ros2": 1,
    "frobs-core": 2,
    "frobs-models": 3,
    "frobs-grippers": 8,
    "more robots": 8,
    "frobs-ray": 8,
    "frobs-cli": 2,
    "simulators": 3,
    "robots": 4,
    "tasks": 5,
    "frobs-tasks-legacy": 5,
    "controllers": 6,
    "frobs-rl-compat": 6,
    "algorithms": 7,
    "frobs-algos": 7,
    "frobs-algos-sbx": 7,
    "lerobot_env_frobs": 5,
}
"""Column of each box; boxes that are not listed share a further one. The rows follow from the imports."""

_SPANS = {"frobs-deploy": 2, "frobs-core": 7}
"""Boxes that are several columns wide."""

_STYLE = """
    text { font-family: system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif; fill: #22272e; }
    .name { font-size: 13px; font-weight: 600; }
    .note { font-size: 11px; fill: #57606a; }
    .ground { fill: #f6f8fa; }
    .box { fill: #ffffff; stroke: #d0d7de; stroke-width: 1.5; }
    .core { fill: #fff4ec; stroke: #e8590c; stroke-width: 2; }
    .line { fill: none; stroke: #8c959f; stroke-width: 1.6; }
    .tip { fill: #8c959f; }
    @media (prefers-color-scheme: dark) {
      text { fill: #e6edf3; }
      .note { fill: #9da7b3; }
      .ground { fill: #161b22; }
      .box { fill: #22272e; stroke: #444c56; }
      .core { fill: #3a2417; stroke: #ff9a5c; }
    }
"""


@dataclass(frozen=True)
class Box:
    """A box of the figure.

    Attributes:
        name: Its title.
        members: Distributions in it.
        row: Layer, 0 at the bottom.
        column: Column of its left edge.
        span: Columns.
    """

    name: str
    members: tuple[str, ...]
    row: int
    column: int
    span: int

    @property
    def width(self) -> float:
        """Width [px]."""
        return (self.span - 1) * _COLUMN + _WIDTH


def figure() -> str:
    """Return the figure as SVG."""
    imports = {name: imported_distributions(found) for name, found in distributions().items() if found.packages}
    boxes = _boxes(imports)
    rows = 1 + max(box.row for box in boxes)
    columns = max(box.column + box.span for box in boxes)
    width, height = 2 * _MARGIN + (columns - 1) * _COLUMN + _WIDTH, 2 * _MARGIN + (rows - 1) * _ROW + _HEIGHT + _ROW
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'role="img" aria-label="{_TITLE}">',
        f"  <title>{_TITLE}</title>",
        f"  <style>{_STYLE}  </style>",
        '  <defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path class="tip" d="M0 0L8 4L0 8z"/></marker></defs>',
        f'  <rect class="ground" width="{width}" height="{height}" rx="14"/>',
    ]
    parts += [_arrow(boxes, pair, rows) for pair in sorted(_arrows(boxes, imports))]
    parts += [line for box in boxes for line in _drawn(box, rows)]
    meta = Box("frobs", ("contains no code; requires the others, except algos-sbx and ray",), rows, 0, columns)
    return "\n".join([*parts, *_drawn(meta, rows), "</svg>", ""])


def _boxes(imports: dict[str, set[str]]) -> list[Box]:
    """Return the boxes: the plugins of a kind share one if they import only what all of a kind share."""
    groups = defaultdict(list)
    for name, lower in imports.items():
        kind = next((kind for start, kind in _KINDS.items() if name.startswith(start)), "")
        title = kind if lower <= {"frobs-core", "frobs-models", "frobs-algos"} else f"more {kind}"
        groups[title if kind else name].append(name)
    free = max(_COLUMNS.values()) + 1
    boxes = []
    for title, members in groups.items():
        name = members[0] if len(members) == 1 and title not in _KINDS.values() else title
        column, span = _COLUMNS.get(name, free), _SPANS.get(name, 1)
        boxes.append(Box(name, tuple(members), max(_layer(member, imports) for member in members), column, span))
    return boxes


def _layer(name: str, imports: dict[str, set[str]]) -> int:
    """Return the layer of a distribution: one above the highest that it imports."""
    return max((1 + _layer(lower, imports) for lower in imports[name]), default=0)


def _arrows(boxes: list[Box], imports: dict[str, set[str]]) -> set[tuple[str, str]]:
    """Return the arrows between boxes, without those that follow from others."""
    owner = {member: box.name for box in boxes for member in box.members}
    direct = defaultdict(set)
    for name, lower in imports.items():
        direct[owner[name]] |= {owner[other] for other in lower}

    def reached(name: str) -> set[str]:
        return direct[name] | {far for near in set(direct[name]) for far in reached(near)}

    return {
        (name, lower)
        for name in list(direct)
        for lower in direct[name]
        if not any(lower in reached(between) for between in direct[name])
    }


def _corner(box: Box, rows: int) -> tuple[float, float]:
    return _MARGIN + box.column * _COLUMN, _MARGIN + (rows - box.row) * _ROW


def _arrow(boxes: list[Box], pair: tuple[str, str], rows: int) -> str:
    upper, lower = (next(box for box in boxes if box.name == name) for name in pair)
    x0, y0 = _corner(upper, rows)
    x1, y1 = _corner(lower, rows)
    x0, y0 = x0 + upper.width / 2, y0 + _HEIGHT
    x1 = min(max(x0, x1 + 16), x1 + lower.width - 16) if lower.span > 1 else x1 + lower.width / 2
    return f'  <path class="line" d="M{x0:g} {y0:g}L{x1:g} {y1 - 3:g}" marker-end="url(#tip)"/>'


def _drawn(box: Box, rows: int) -> list[str]:
    x, y = _corner(box, rows)
    style = "core" if box.name == "frobs-core" else "box"
    lines = [f'  <rect class="{style}" x="{x:g}" y="{y:g}" width="{box.width:g}" height="{_HEIGHT}" rx="9"/>']
    notes = [_short(member) for member in box.members if member != box.name]
    top = y + (_HEIGHT + 10) / 2 - 7.5 * len(notes)
    lines.append(f'  <text class="name" x="{x + 9:g}" y="{top:g}">{escape(_short(box.name))}</text>')
    for i, note in enumerate(notes):
        lines.append(f'  <text class="note" x="{x + 9:g}" y="{top + 15 * (i + 1):g}">{escape(note)}</text>')
    return lines


def _short(name: str) -> str:
    """Return a name without FRobs, and only its last word if it is long."""
    short = name.removeprefix("frobs-").removesuffix("_frobs")
    return short if len(short) <= 16 or " " in short else f"…-{short.rpartition('-')[2]}"
