"""Common plot style, and figures that do not require a display."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

from frobs_core.util.errors import ParameterValueError, RunError
from frobs_core.util.files import write_aside
from frobs_core.util.install_hints import local_install_hint

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#444444")
"""Colors that color-blind people can distinguish (Okabe and Ito 2008, without yellow)."""

INK = "#2b2b2b"
"""Color of text."""

FAINT = "#9a9a9a"
"""Color of threshold lines."""

FORMATS = (".png", ".pdf", ".svg")
"""Endings of the files that a figure can be saved to."""

SizeName: TypeAlias = Literal["screen", "page", "column"]


@dataclass(frozen=True)
class Size:
    """Size of a figure's parts."""

    panel: tuple[float, float]  # width and height of a panel [inches]
    columns: int  # maximum number of panels side by side
    font: float  # font size [pt]


SIZES: Mapping[str, Size] = {
    "screen": Size((5.3, 3.9), 3, 9.0),
    "page": Size((3.4, 2.5), 2, 8.0),
    "column": Size((3.4, 2.4), 1, 8.0),
}
"""Sizes by name: for a screen, for the full width of a page, and for a column of a paper in two columns."""

_ALGORITHMS = ("ppo", "sac", "dagger", "td3", "bc", "act", "a2c")
"""Algorithms with a fixed color, in the order of :data:`COLORS`."""


@contextmanager
def style(size: SizeName = "screen") -> Iterator[Size]:
    """Draw with the fonts of a size within a ``with`` block. Raise RunError if matplotlib is not installed."""
    chosen = SIZES[size]
    # Journals require embedded TrueType fonts, and text in SVG files should stay text. The salt keeps files repeatable.
    fixed = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "frobs"}
    with _matplotlib().rc_context({**fixed, "font.size": chosen.font}):
        yield chosen


def make_figure(width: float, height: float) -> Any:
    """Return an empty matplotlib figure, which can only be saved to files.

    Args:
        width: Width of the figure [inches].
        height: Height of the figure [inches].

    Raises:
        RunError: matplotlib is not installed.
    """
    _matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def check_picture(path: Path | str) -> Path:
    """Return the path of a picture, or raise ParameterValueError if its ending is none of :data:`FORMATS`."""
    target = Path(path)
    if target.suffix.lower() not in FORMATS:
        raise ParameterValueError(
            "picture", str(path), f"a file that ends in {', '.join(FORMATS[:-1])} or {FORMATS[-1]}"
        )
    return target


def save_figure(figure: Any, path: Path) -> Path:
    """Save a figure in the format of the path's ending, and return the path. A broken write leaves no file."""
    ending = path.suffix.lower().removeprefix(".")
    metadata = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(ending)
    write_aside(path, lambda aside: figure.savefig(aside, format=ending, metadata=metadata))
    return path


def colors_of(algorithms: Mapping[str, str]) -> dict[str, str]:
    """Return a color for each label, given its algorithm, which has the same color in every picture.

    Further labels with the same algorithm receive the colors that are left.
    """
    chosen: dict[str, str] = {}
    for label, algorithm in algorithms.items():
        known = _ALGORITHMS.index(algorithm) if algorithm in _ALGORITHMS else zlib.crc32(algorithm.encode())
        color = COLORS[known % len(COLORS)]
        if color not in chosen.values():
            chosen[label] = color
    left = [color for color in COLORS if color not in chosen.values()] or list(COLORS)
    others = [label for label in algorithms if label not in chosen]
    chosen |= {label: left[index % len(left)] for index, label in enumerate(others)}
    return {label: chosen[label] for label in algorithms}


def dress(axis: Any, title: str = "", x_label: str = "", y_label: str = "") -> None:
    """Apply the common style to the grid, ticks and labels of a matplotlib ``Axes`` object.

    Args:
        axis: The axes.
        title: Title above the axes, or ``""`` for none.
        x_label: Label of the x axis.
        y_label: Label of the y axis.
    """
    axis.grid(color="#e4e4e4", linewidth=0.8)
    axis.set_axisbelow(True)
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    axis.spines["bottom"].set_color("#b0b0b0")
    axis.tick_params(colors=INK, labelsize="medium", length=0)
    if title:
        axis.set_title(title, loc="left", fontsize="medium", color=INK)
    axis.set_xlabel(x_label, fontsize="medium", color=INK)
    axis.set_ylabel(y_label, fontsize="medium", color=INK)


def _matplotlib() -> Any:
    try:
        import matplotlib
    except ImportError as error:
        hint = local_install_hint("pip install 'frobs-train[plots]'")
        raise RunError(f"plotting requires matplotlib; install it with: {hint}") from error
    return matplotlib
