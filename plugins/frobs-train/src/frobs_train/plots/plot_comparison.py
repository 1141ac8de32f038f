"""Plots of comparisons: learning curves with bands, and the final results of the groups."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from frobs_train.comparison.compare import Comparison, Group
from frobs_train.comparison.confidence import LEAST_RUNS
from frobs_train.plots.figures import (
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
from frobs_train.plots.plot import THRESHOLD, curve_title, dress_curves, in_axis_units, percent_axis

_TITLES = {"success": "Success", "reward": "Reward of an episode"}
_ROW = 0.04  # height of one row in the lower part [inch], per point of the font


def plot_comparison(found: Comparison, path: Path | str, *, size: SizeName = "screen") -> Path:
    """Plot a comparison as a PNG, PDF or SVG file.

    The upper part has one panel per environment, which shows the interquartile mean over seeds with its 95 % band, and
    one panel with performance profiles if there are aggregates over the environments. The lower part shows the final
    results of each group: the result of each seed (dot), the interquartile mean (line) and its 95 % interval (band).

    Args:
        found: Result of :func:`frobs_train.compare`.
        path: File to write; its ending selects the format.
        size: ``"screen"``, or for papers ``"page"`` or ``"column"``.

    Returns:
        The path of the written file.

    Raises:
        RunError: matplotlib is not installed.
        ParameterValueError: The format of the file is unknown.
    """
    target = check_picture(path)
    environments: dict[str, list[Group]] = {}
    for group in found.groups:
        environments.setdefault(group.environment, []).append(group)
    count = len(environments) + bool(found.aggregates)
    # Groups with the same name have the same color in all panels.
    colors = colors_of({group.name: group.algorithm for group in found.groups})
    with style(size) as chosen:
        columns = min(count, 2 if count == 4 else 3, chosen.columns)
        rows = -(-count // columns)
        below = 0.1 * chosen.font + (_ROW if size == "screen" else 0.8 * _ROW) * chosen.font * (
            len(found.groups) + len(environments) * (len(environments) > 1)
        )
        width, above = columns * chosen.panel[0], rows * chosen.panel[1]
        figure = make_figure(max(8.0, width) if size == "screen" else width, 0.5 + above + below)
        upper, lower = figure.subfigures(2, 1, height_ratios=[above, below], hspace=0.04)
        axes = upper.subplots(rows, columns, squeeze=False).flatten()
        for axis, (environment, members) in zip(axes, environments.items(), strict=False):
            _draw_curves(axis, found, members, colors, "" if len(environments) == 1 else environment)
        for axis in axes[count:]:
            axis.set_visible(False)
        if found.aggregates:
            _draw_profiles(axes[len(environments)], found, colors)
        _draw_finals(lower.subplots(), found, environments, colors, narrow=size != "screen")
        words = f"{_TITLES[found.metric]} at the end: seeds (dots), interquartile mean (line), 95 % interval (band)"
        if size == "screen":
            lower.suptitle(words, x=0.01, ha="left", fontsize="large", color=INK)
            title = _title(found, list(environments))
            figure.suptitle(title, x=0.01, ha="left", fontsize="x-large", fontweight="bold", color=INK)
        upper.suptitle(curve_title(found.metric, found.source), x=0.01, ha="left", fontsize="large", color=INK)
        return save_figure(figure, target)


def _title(found: Comparison, environments: Sequence[str]) -> str:
    runs = sum(len(group.runs) for group in found.groups)
    where = environments[0] if len(environments) == 1 else f"{len(environments)} environments"
    groups = f" in {len(found.groups)} groups" if len(found.groups) > 1 else ""
    return f"{where} · {runs} run{'s' if runs > 1 else ''}{groups}"


def _draw_curves(axis: Any, found: Comparison, groups: Sequence[Group], colors: dict[str, str], title: str) -> None:
    dress_curves(axis, title, found.over)
    if found.metric == "success":
        percent_axis(axis)
    scale = _scale(found)
    if found.threshold is not None:
        axis.axhline(scale * found.threshold, **THRESHOLD)
    for group in groups:
        curve, color = group.curve, colors[group.name]
        x = in_axis_units(curve.x, found.over)
        if len(group.runs) >= LEAST_RUNS:
            axis.fill_between(x, scale * curve.low, scale * curve.high, color=color, alpha=0.18, linewidth=0)
        axis.plot(x, scale * curve.middle, color=color, linewidth=2.0)


def _draw_profiles(axis: Any, found: Comparison, colors: dict[str, str]) -> None:
    """Draw the fraction of the runs of all environments whose success is above each value."""
    dress(axis, "all environments", "success above", "fraction of runs")
    axis.set_ylim(-0.02, 1.02)
    axis.xaxis.set_major_formatter(lambda value, _: f"{100.0 * value:.0f} %")
    for each in found.aggregates:
        curve, color = each.profile, colors[each.name]
        axis.fill_between(curve.x, curve.low, curve.high, color=color, alpha=0.18, linewidth=0, step="post")
        axis.step(curve.x, curve.middle, color=color, linewidth=2.0, where="post")


def _draw_finals(
    axis: Any, found: Comparison, environments: dict[str, list[Group]], colors: dict[str, str], narrow: bool
) -> None:
    """Draw one row for each group. If there are several environments, their names are shown as headings."""
    dress(axis)
    scale, row = _scale(found), 0
    ticks: list[tuple[int, str, str]] = []
    for environment, members in environments.items():
        if len(environments) > 1:
            ticks.append((row, environment, FAINT))
            row += 1
        for group in members:
            seeds = "" if narrow else f"  ({len(group.runs)} seed{'s' if len(group.runs) > 1 else ''})"
            ticks.append((row, f"{group.name}{seeds}", colors[group.name]))
            _draw_final(axis, group, row, scale, colors[group.name])
            row += 1
    axis.set_ylim(row - 0.4, -0.6)
    axis.set_yticks([place for place, _, _ in ticks], [name for _, name, _ in ticks])
    for label, (_, _, color) in zip(axis.get_yticklabels(), ticks, strict=True):
        label.set_color(color)  # the colored labels also serve as the legend of the curves
    axis.grid(visible=False, axis="y")
    if found.metric == "success":
        least = min(score.final for group in found.groups for score in group.runs)
        start = min(80.0, 10.0 * (scale * min(least, found.threshold or 0.0) // 10.0))
        axis.set_xlim(start - 0.02 * (100.0 - start), 100.0 + 0.02 * (100.0 - start))
        axis.xaxis.set_major_formatter(lambda value, _: f"{value:.0f} %")
        axis.axvline(scale * (found.threshold or 0.0), **THRESHOLD)


def _draw_final(axis: Any, group: Group, row: int, scale: float, color: str) -> None:
    final = group.final
    if final.low is not None and final.high is not None:
        axis.plot([scale * final.low, scale * final.high], [row, row], color=color, linewidth=7, alpha=0.25,
                  solid_capstyle="butt", zorder=2)  # fmt: skip
    axis.plot([score.final * scale for score in group.runs], [row] * len(group.runs), linestyle="", marker="o",
              markersize=4.5, color=color, markeredgecolor="white", markeredgewidth=0.7, zorder=4, clip_on=False)  # fmt: skip
    axis.plot([scale * final.value] * 2, [row - 0.3, row + 0.3], color=color, linewidth=2.5, zorder=3, clip_on=False)
    value = f"{scale * final.value:.1f} %" if scale != 1.0 else f"{final.value:.3g}"
    axis.annotate(value, (1.0, row), xycoords=("axes fraction", "data"), xytext=(10, 0), textcoords="offset points",
                  ha="left", va="center", fontsize="medium", color=color, annotation_clip=False)  # fmt: skip


def _scale(found: Comparison) -> float:
    return 100.0 if found.metric == "success" else 1.0
