"""Common plot style, and figures that do not require a display."""

from __future__ import annotations

from typing import Any

from frobs_core.util.errors import RunError

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#444444")
"""Colors that color-blind people can distinguish (Okabe and Ito 2008, without yellow)."""

INK = "#2b2b2b"
"""Color of text."""

FAINT = "#9a9a9a"
"""Color of threshold lines."""


def make_figure(width: float, height: float) -> Any:
    """Return an empty matplotlib figure of the given size [inch], which can only be saved to files."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise RunError("plotting requires matplotlib; install it with: pip install 'frobs-train[plots]'") from error
    figure = Figure(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def dress(axis: Any, title: str = "", x_label: str = "", y_label: str = "") -> None:
    """Apply the common style to the grid, ticks and labels of a matplotlib ``Axes`` object."""
    axis.grid(color="#e4e4e4", linewidth=0.8)
    axis.set_axisbelow(True)
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    axis.spines["bottom"].set_color("#b0b0b0")
    axis.tick_params(colors=INK, labelsize=9, length=0)
    if title:
        axis.set_title(title, loc="left", fontsize=10, color=INK)
    axis.set_xlabel(x_label, fontsize=9, color=INK)
    axis.set_ylabel(y_label, fontsize=9, color=INK)
