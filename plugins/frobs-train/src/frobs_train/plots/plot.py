"""Plots of runs: success, reward and reward terms over environment steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import RunError
from frobs_core.util.files import write_aside
from frobs_train.comparison.groups import group_runs
from frobs_train.logs.progress import STEPS, read_columns, smooth
from frobs_train.plots.figures import COLORS, FAINT, INK, dress, make_figure
from frobs_train.runs.run import Run


@dataclass(frozen=True)
class _Curves:
    """Log of one run, with raw and smoothed columns of shape (rows,)."""

    run: Run
    columns: dict[str, Floats]

    def __getitem__(self, name: str) -> Floats:
        missing = np.full(len(self.columns[STEPS]), np.nan)
        return self.columns.get(name, missing)

    def smooth(self, name: str) -> Floats:
        return smooth(self[name], self["episode/count"])


def plot_runs(runs: Sequence[Run], path: Path | str | None = None) -> Path:
    """Plot the learning curves of runs as a PNG file.

    Runs that differ only in their seed form a group. Each group is drawn as a bold mean line with a band between the
    lowest and the highest run. Reward terms are also plotted if all runs belong to the same group.

    Args:
        runs: One or more runs to plot.
        path: File to write. Defaults to ``plots/learning_curve.png`` in the folder of a single run, or to
            ``learning_curves.png`` next to the first of several runs.

    Returns:
        The path of the written file.

    Raises:
        RunError: matplotlib is not installed, no runs are given, or a run has no log yet.
    """
    curves = [_Curves(run, read_columns(run.path)) for run in runs]
    if not curves:
        raise RunError("there is no run to plot; pass at least one run folder.")
    groups = _groups(curves)
    terms = _terms(curves[0]) if len(groups) == 1 else []
    panels = [panel for panel, has_data in ((_success, _has(curves, "episode/success")), (_reward, True)) if has_data]
    figure = make_figure(5.2 * (len(panels) + bool(terms)), 4.2)
    axes = figure.subplots(1, len(panels) + bool(terms), squeeze=False)[0]
    for axis, draw in zip(axes, panels, strict=False):
        _dress(axis)
        draw(axis, groups)
    if terms:
        _dress(axes[-1])
        _draw_terms(axes[-1], next(iter(groups.values())), terms)
    if len(groups) > 1:
        axes[0].legend(frameon=False, fontsize=9, labelcolor=INK)
    figure.suptitle(_title(groups), x=0.01, ha="left", fontsize=13, fontweight="bold", color=INK)

    target = Path(path) if path is not None else _default_path(runs)
    write_aside(target, lambda aside: figure.savefig(aside, format="png"))
    return target


def _groups(curves: Sequence[_Curves]) -> dict[str, list[_Curves]]:
    """Group runs that differ only in the seed."""
    by_path = {curve.run.path: curve for curve in curves}
    groups = group_runs([curve.run for curve in curves])
    return {label: [by_path[run.path] for run in members] for label, members in groups.items()}


def _title(groups: dict[str, list[_Curves]]) -> str:
    if len(groups) > 1:
        return f"{sum(len(members) for members in groups.values())} runs"
    name, members = next(iter(groups.items()))
    seeds = ", ".join(str(member.run.config.seed) for member in members)
    return f"{name} · seed{'s' if len(members) > 1 else ''} {seeds}"


def _success(axis: Any, groups: dict[str, list[_Curves]]) -> None:
    axis.set_title("Success at the end of the episode", loc="left", fontsize=10, color=INK)
    axis.set_ylim(-2, 102)
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:.0f} %")
    axis.axhline(95, color=FAINT, linewidth=0.8, linestyle=(0, (4, 3)))
    for color, (name, members) in zip(_colors(groups), groups.items(), strict=True):
        _draw(axis, members, "episode/success", color, name, 100.0)
        _draw_evaluations(axis, members, "evaluation/success", color, 100.0)
        for member in members:
            _mark_evaluation(axis, member, color, len(groups) == len(members) == 1)


def _reward(axis: Any, groups: dict[str, list[_Curves]]) -> None:
    axis.set_title("Reward of an episode", loc="left", fontsize=10, color=INK)
    for color, (name, members) in zip(_colors(groups), groups.items(), strict=True):
        _draw(axis, members, "episode/reward", color, name)
        _draw_evaluations(axis, members, "evaluation/reward", color)


def _draw_terms(axis: Any, members: Sequence[_Curves], terms: Sequence[str]) -> None:
    axis.set_title("Reward terms of an episode", loc="left", fontsize=10, color=INK)
    for color, term in zip(_colors(terms), terms, strict=True):
        _draw(axis, members, f"reward/{term}", color, term.replace("_", " "))
    axis.legend(frameon=False, fontsize=9, labelcolor=INK)


def _draw(axis: Any, members: Sequence[_Curves], name: str, color: str, label: str, scale: float = 1.0) -> None:
    """Draw a single run with its raw values in the background, or several runs as a mean line with a band."""
    if len(members) == 1:
        axis.plot(members[0][STEPS], scale * members[0][name], color=color, alpha=0.25, linewidth=0.8)
        smooth = members[0].smooth(name)
        known = np.isfinite(smooth)  # a smoothed value is NaN if no episode ended in its window
        axis.plot(members[0][STEPS][known], scale * smooth[known], color=color, linewidth=2.0, label=label)
        return
    steps = np.unique(np.concatenate([member[STEPS] for member in members]))
    steps = steps[steps <= min(member[STEPS][-1] for member in members)]
    rows = np.stack([_at(steps, member, name) for member in members])  # (runs, steps)
    axis.fill_between(steps, scale * rows.min(0), scale * rows.max(0), color=color, alpha=0.18, linewidth=0)
    axis.plot(steps, scale * rows.mean(0), color=color, linewidth=2.0, label=label)


def _draw_evaluations(axis: Any, members: Sequence[_Curves], name: str, color: str, scale: float = 1.0) -> None:
    """Draw the results of evaluations during training as small circles."""
    for member in members:
        known = np.isfinite(member[name])
        if not known.any():
            continue
        axis.plot(
            member[STEPS][known], scale * member[name][known], linestyle="none", marker="o", markersize=3.5,
            markerfacecolor="white", markeredgecolor=color, markeredgewidth=1.0, zorder=4, clip_on=False,
        )  # fmt: skip


def _at(steps: Floats, member: _Curves, name: str) -> Floats:
    values = member.smooth(name)
    valid = np.isfinite(values)
    if not valid.any():
        return np.full(len(steps), np.nan)
    return np.interp(steps, member[STEPS][valid], values[valid], left=np.nan)


def _mark_evaluation(axis: Any, member: _Curves, color: str, annotate: bool) -> None:
    """Mark the latest evaluation that reported success, with its confidence interval."""
    results = [result for result in member.run.evaluations() if result.get("success_rate") is not None
             and result.get("success_interval") is not None]  # fmt: skip
    if not results:
        return
    latest = max(results, key=lambda result: (result["steps"], result["episodes"]))
    rate, interval = 100.0 * latest["success_rate"], latest["success_interval"]
    error = [[rate - 100.0 * interval[0]], [100.0 * interval[1] - rate]]
    axis.errorbar(
        [latest["steps"]], [rate], yerr=error, fmt="o", color=color, markersize=6,
        markeredgecolor="white", markeredgewidth=1.2, capsize=3, zorder=5, clip_on=False,
    )  # fmt: skip
    if annotate:
        text = f"{rate:.1f} % of {latest['episodes']}\nnew episodes"
        height = 0.04 if rate > 50.0 else 0.75  # below or above the end of the curve
        axis.annotate(text, (0.98, height), xycoords="axes fraction", ha="right", fontsize=9, color=color)


def _dress(axis: Any) -> None:
    dress(axis, x_label="environment steps")
    axis.xaxis.set_major_formatter(lambda value, _: count_text(value))
    axis.margins(x=0.02)


def count_text(value: float) -> str:
    """Format a number of steps, for example as ``"300 k"`` or ``"1.5 M"``."""
    for size, unit in ((1e6, " M"), (1e3, " k")):
        if abs(value) >= size:
            return f"{value / size:.3g}{unit}"
    return f"{value:.3g}"


def _colors(items: Any) -> list[str]:
    return [COLORS[index % len(COLORS)] for index in range(len(items))]


def _has(curves: Sequence[_Curves], name: str) -> bool:
    return any(bool(np.isfinite(curve[name]).any()) for curve in curves)


def _terms(curve: _Curves) -> list[str]:
    return [name.removeprefix("reward/") for name in curve.columns if name.startswith("reward/")]


def _default_path(runs: Sequence[Run]) -> Path:
    if len(runs) == 1:
        return runs[0].output("plots", "learning_curve.png")
    return runs[0].path.parent / "learning_curves.png"
