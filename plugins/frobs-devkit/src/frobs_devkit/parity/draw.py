"""Draws a measurement as a PNG image."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from frobs_devkit.parity.result import Line, Measurement, Panel
from frobs_train import COLORS, INK, dress, make_figure

_BAD = "#C22E2E"  # color of the tolerance
_BOTTOM = 1e-17  # value that represents zero on a logarithmic axis, below the rounding error of numbers near 1
_STROKES: tuple[Any, ...] = ("-", (0, (3, 2)), (0, (1, 1.5)), (0, (5, 1, 1, 1)))
_MARKS = ("o", "x", "+", "d")


def draw(measurement: Measurement, simulators: Sequence[str]) -> bytes:
    """Draw the panels of a measurement side by side.

    The reference is drawn as a broad pale line, and every other simulator as a thin dark line on top of it. If two
    simulators agree, the dark line runs along the middle of the pale line.
    """
    figure = make_figure(max(5.6, 4.9 * len(measurement.panels)), 4.2)
    axes = figure.subplots(1, len(measurement.panels), squeeze=False)[0]
    for axis, panel in zip(axes, measurement.panels, strict=True):
        dress(axis, panel.title, panel.x_label, panel.y_label)
        if panel.bars:
            _bars(axis, panel)
        else:
            _lines(axis, panel, simulators)
    figure.suptitle(measurement.title, x=0.01, ha="left", fontsize=13, fontweight="bold", color=INK)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _lines(axis: Any, panel: Panel, simulators: Sequence[str]) -> None:
    errors = panel.log and panel.tolerance is not None
    for line in panel.lines:
        y = np.maximum(line.y, _BOTTOM) if panel.log else line.y
        axis.plot(line.x, y, **_stroke(line, panel))
    if panel.lines and all((line.x == np.round(line.x)).all() for line in panel.lines):
        axis.xaxis.get_major_locator().set_params(integer=True)
    if panel.log:
        axis.set_yscale("log")
        values = np.concatenate([np.asarray(line.y) for line in panel.lines] or [np.ones(1)])
        highest = max([float(np.nanmax(values, initial=_BOTTOM)), *([panel.tolerance] if panel.tolerance else [])])
        axis.set_ylim(0.4 * _BOTTOM, 30.0 * highest)
        if not (values > _BOTTOM).any():
            axis.annotate(
                "no difference at all", (0.5, 0.06), xycoords="axes fraction", ha="center", fontsize=9, color=INK
            )
    if panel.tolerance is not None:
        axis.axhline(panel.tolerance, color=_BAD, linewidth=1.1, linestyle=(0, (4, 3)))
        axis.annotate(
            f"tolerance {panel.tolerance:g}", (1.0, panel.tolerance), xycoords=("axes fraction", "data"),
            xytext=(-2, 3), textcoords="offset points", ha="right", fontsize=8, color=_BAD,
        )  # fmt: skip
    if panel.rows:
        axis.set_yticks(range(len(panel.rows)), panel.rows)
        axis.set_ylim(len(panel.rows) - 0.4, -0.6)
        return
    if panel.map:
        axis.set_aspect("equal", adjustable="datalim")
        axis.plot([0.0], [0.0], marker="+", color=INK, markersize=9, linestyle="none")
    _legend(axis, panel, simulators, errors)


def _stroke(line: Line, panel: Panel) -> dict[str, Any]:
    color = COLORS[line.color % len(COLORS)]
    if line.points:
        mark = _MARKS[line.simulator % len(_MARKS)]
        hollow = {"markerfacecolor": "none"} if mark in "od" else {}
        return {"color": color, "marker": mark, "markersize": 5 if mark in "od" else 4, "linestyle": "none", **hollow}
    if panel.log:
        return {"color": color, "linewidth": 1.3}
    if line.simulator == 0:
        return {"color": color, "linewidth": 4.0, "alpha": 0.35, "solid_capstyle": "round"}
    return {"color": color, "linewidth": 1.2, "linestyle": _STROKES[line.simulator % len(_STROKES)]}


def _legend(axis: Any, panel: Panel, simulators: Sequence[str], errors: bool) -> None:
    from matplotlib.lines import Line2D

    by_label = {line.label: line for line in panel.lines}
    handles = []
    for label, line in by_label.items():
        own = line.points or panel.log or label in simulators
        look = _stroke(line, panel) if own else {"color": COLORS[line.color % len(COLORS)]}
        handles.append(Line2D([], [], label=label, **{"linewidth": 1.6, **look}))
    used = sorted({line.simulator for line in panel.lines})
    if (
        not panel.log
        and not any(line.points for line in panel.lines)
        and len(used) > 1
        and not set(by_label) <= set(simulators)
    ):
        for number in used:
            look = _stroke(Line("", np.zeros(0), np.zeros(0), 6, number), panel)
            handles.append(Line2D([], [], label=simulators[number], **look))
    axis.legend(handles=handles, frameon=False, fontsize=8, labelcolor=INK, loc="best", ncols=1 + (len(handles) > 8))


def _bars(axis: Any, panel: Panel) -> None:
    for i, (label, (value, low, high)) in enumerate(panel.bars.items()):
        color = COLORS[i % len(COLORS)]
        axis.bar([label], [value], color=color, alpha=0.35 if i == 0 else 0.75, width=0.5)
        axis.errorbar([label], [value], yerr=[[value - low], [high - value]], color=INK, capsize=5, linewidth=1.2)
        axis.annotate(
            f"{value:.1f} %", (i, 0.0), xytext=(0, 6), textcoords="offset points", ha="center", fontsize=10, color=INK
        )
    axis.set_ylim(0.0, 105.0)
    axis.grid(axis="x", visible=False)
