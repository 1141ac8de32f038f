"""Plots of runs: success, reward and reward terms over environment steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import RunError
from frobs_train.comparison.groups import group_runs
from frobs_train.comparison.scores import CurveAxis, CurveSource, curve_column, curve_source, curve_values
from frobs_train.logs.progress import read_columns
from frobs_train.plots.figures import (
    COLORS,
    FAINT,
    INK,
    SizeName,
    check_picture,
    colors_of,
    dress,
    make_figure,
    save_figure,
    style,
)
from frobs_train.runs.evaluation_files import is_as_trained
from frobs_train.runs.run import Run

_X_LABELS: Mapping[CurveAxis, str] = {"steps": "environment steps", "time": "time of training [min]"}
_TITLES: Mapping[CurveSource, str] = {
    "evaluation": "{} in evaluations",
    "training": "{} during training, with exploration",
}
THRESHOLD: Mapping[str, Any] = {"color": FAINT, "linewidth": 0.8, "linestyle": (0, (4, 3)), "zorder": 1}
"""Style of the line of a threshold."""


@dataclass(frozen=True)
class _Curves:
    """Log of one run, with columns of shape (rows,), and what is drawn of it."""

    run: Run
    columns: dict[str, Floats]
    over: CurveAxis

    def curve(self, name: str) -> tuple[Floats, Floats]:
        """Return x, as drawn, and y of the learning curve in a column, (points,) each."""
        x, y = curve_values(self.columns, name, self.over)
        return in_axis_units(x, self.over), y


def plot_runs(
    runs: Sequence[Run],
    path: Path | str | None = None,
    *,
    source: CurveSource | None = None,
    over: CurveAxis = "steps",
    size: SizeName = "screen",
) -> Path:
    """Plot the learning curves of runs as a PNG, PDF or SVG file.

    Runs that differ only in their seed form a group. Each group is drawn as a bold mean line with a band between the
    lowest and the highest run. Reward terms are also plotted if all runs belong to the same group.

    Args:
        runs: One or more runs to plot.
        path: File to write; its ending selects the format. Defaults to ``plots/learning_curve.png`` in the folder of a
            single run, or to ``learning_curves.png`` next to the first of several runs.
        source: Values that the curves show: ``"evaluation"`` or ``"training"``. Defaults to evaluations during training, or if
            a run has none, to the episodes of training, in which the policy explores.
        over: Quantity on the x axis: ``"steps"`` or ``"time"``.
        size: ``"screen"``, or for papers ``"page"`` or ``"column"``.

    Returns:
        The path of the written file.

    Raises:
        RunError: matplotlib is missing, no runs are given, or a run has no log or no evaluations to show.
        ParameterValueError: The format of the file is unknown.
    """
    curves = [_Curves(run, read_columns(run.path), over) for run in runs]
    if not curves:
        raise RunError("there is no run to plot; pass at least one run folder.")
    one = runs[0]
    usual = one.output("plots", "learning_curve.png") if len(runs) == 1 else one.path.parent / "learning_curves.png"
    target = check_picture(usual if path is None else path)
    source = curve_source({each.run.path: each.columns for each in curves}, "reward", source)
    by_path = {curve.run.path: curve for curve in curves}
    groups = {label: [by_path[run.path] for run in members] for label, members in group_runs(runs).items()}
    metrics = (
        ["success", "reward"]
        if any(len(each.curve(curve_column("success", source))[0]) for each in curves)
        else ["reward"]
    )
    logged = curves[0].columns.items() if len(groups) == 1 else ()
    terms = [name[7:] for name, values in logged if name.startswith("reward/") and np.isfinite(values).any()]
    count = len(metrics) + bool(terms)
    with style(size) as chosen:
        columns = min(count, chosen.columns)
        rows = -(-count // columns)
        figure = make_figure(columns * chosen.panel[0], 0.3 + rows * chosen.panel[1])
        axes = figure.subplots(rows, columns, squeeze=False).flatten()
        for axis, metric in zip(axes, metrics, strict=False):
            _draw_metric(axis, groups, metric, source)
        if terms:
            _draw_terms(axes[len(metrics)], next(iter(groups.values())), terms)
        for axis in axes[count:]:
            axis.set_visible(False)
        if len(groups) > 1:
            axes[0].legend(frameon=False, fontsize="medium", labelcolor=INK)
        figure.suptitle(_title(groups), x=0.01, ha="left", fontsize="x-large", fontweight="bold", color=INK)
        return save_figure(figure, target)


def in_axis_units(x: Floats, over: CurveAxis) -> Floats:
    """Return steps unchanged, and times [s] in minutes."""
    return x if over == "steps" else x / 60.0


def dress_curves(axis: Any, title: str, over: CurveAxis) -> None:
    """Apply the common style to the axes of learning curves."""
    dress(axis, title, _X_LABELS[over])
    if over == "steps":
        axis.xaxis.set_major_formatter(lambda value, _: count_text(value))
    axis.locator_params(axis="x", nbins=6)
    axis.margins(x=0.02)


def percent_axis(axis: Any) -> None:
    """Let a y axis show a rate from 0 to 100 %."""
    axis.set_ylim(-2, 102)
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:.0f} %")


def curve_title(metric: str, source: CurveSource) -> str:
    """Return the title of learning curves, which states the plotted metric and its source."""
    return _TITLES[source].format("Success" if metric == "success" else "Reward of an episode")


def _title(groups: dict[str, list[_Curves]]) -> str:
    if len(groups) > 1:
        return f"{sum(len(members) for members in groups.values())} runs"
    name, members = next(iter(groups.items()))
    seeds = ", ".join(str(member.run.config.seed) for member in members)
    return f"{name} · seed{'s' if len(members) > 1 else ''} {seeds}"


def _draw_metric(axis: Any, groups: dict[str, list[_Curves]], metric: str, source: CurveSource) -> None:
    dress_curves(axis, curve_title(metric, source), next(iter(groups.values()))[0].over)
    scale = 1.0
    if metric == "success":
        scale = 100.0
        percent_axis(axis)
        axis.axhline(95, **THRESHOLD)
    colors = colors_of({name: members[0].run.config.algorithm for name, members in groups.items()})
    for name, members in groups.items():
        _draw(axis, [member.curve(curve_column(metric, source)) for member in members], colors[name], name, scale)
        if metric == "success":
            for member in members:
                _mark_evaluation(axis, member, colors[name], len(groups) == len(members) == 1)


def _draw_terms(axis: Any, members: Sequence[_Curves], terms: Sequence[str]) -> None:
    dress_curves(axis, "Reward terms during training", members[0].over)
    for index, term in enumerate(terms):
        curves = [member.curve(f"reward/{term}") for member in members]
        _draw(axis, curves, COLORS[index % len(COLORS)], term.replace("_", " "))
    axis.legend(frameon=False, fontsize="medium", labelcolor=INK)


def _draw(axis: Any, curves: Sequence[tuple[Floats, Floats]], color: str, label: str, scale: float = 1.0) -> None:
    """Draw the curve of a single run, or several curves as a mean line with a band from the lowest to the highest."""
    known = [(x, y) for x, y in curves if len(x)]
    if len(known) > 1:
        grid = np.unique(np.concatenate([x for x, _ in known]))
        grid = grid[grid <= min(x[-1] for x, _ in known)]
        rows = scale * np.stack([np.interp(grid, x, y, left=np.nan) for x, y in known])  # (runs, points)
        axis.fill_between(grid, rows.min(0), rows.max(0), color=color, alpha=0.18, linewidth=0)
        known = [(grid, rows.mean(0) / scale)]
    for x, y in known:
        axis.plot(x, scale * y, color=color, linewidth=2.0, label=label, marker="o" if len(x) < 2 else None)


def _mark_evaluation(axis: Any, member: _Curves, color: str, annotate: bool) -> None:
    """Mark the latest evaluation that reported success and ran as in training, with its confidence interval."""
    results = [result for result in member.run.evaluations() if result.get("success_rate") is not None
             and result.get("success_interval") is not None and is_as_trained(result)]  # fmt: skip
    if not results:
        return
    latest = max(results, key=lambda result: (result["steps"], result["episodes"]))
    rate, interval = 100.0 * latest["success_rate"], latest["success_interval"]
    error = [[rate - 100.0 * interval[0]], [100.0 * interval[1] - rate]]
    at = [latest["steps"]] if member.over == "steps" else in_axis_units(member.columns["time/elapsed"][-1:], "time")
    axis.errorbar(
        at, [rate], yerr=error, fmt="o", color=color, markersize=6,
        markeredgecolor="white", markeredgewidth=1.2, capsize=3, zorder=5, clip_on=False,
    )  # fmt: skip
    if annotate:
        text = f"{rate:.1f} % of {latest['episodes']}\nnew episodes"
        height = 0.04 if rate > 50.0 else 0.75  # below or above the end of the curve
        axis.annotate(text, (0.98, height), xycoords="axes fraction", ha="right", fontsize="medium", color=color)


def count_text(value: float) -> str:
    """Format ``value``, a number of steps, for example as ``"300 k"`` or ``"1.5 M"``."""
    for size, unit in ((1e6, " M"), (1e3, " k")):
        if abs(value) >= size:
            return f"{value / size:.3g}{unit}"
    return f"{value:.3g}"
