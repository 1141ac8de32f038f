"""Plots speed and memory against the number of environments, threads, processes and nodes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.files import write_aside
from frobs_devkit.scaling.model import ScalingModel
from frobs_devkit.scaling.results import CLUSTER, NUM_ENVS, PROCESSES, THREADS, ScalingPoint, ScalingResult
from frobs_train import COLORS, INK, count_text, dress, make_figure

_STYLES = {
    THREADS: ("--", "s", "threads of one process"),
    PROCESSES: ("-", "o", "processes on one machine"),
    CLUSTER: ("-.", "D", "processes on a cluster"),
}


def plot_scaling(results: Sequence[tuple[ScalingResult, ScalingModel, int]], path: Path | str) -> Path:
    """Plot measurements and predictions as a PNG image.

    Args:
        results: For each environment, the measurements, the model, and the number of processes per node for the
            prediction.
        path: PNG file to write.

    Returns:
        Path of the PNG file.

    Raises:
        RunError: matplotlib is not installed.
    """
    figure = make_figure(11.0, 8.2)
    axes = figure.subplots(2, 2)
    _draw_num_envs(axes[0, 0], axes[0, 1], results)
    _draw_side_by_side(axes[1, 0], results)
    _draw_prediction(axes[1, 1], results)
    names = " and ".join(result.id for result, _, _ in results)
    figure.suptitle(f"Scaling of {names}", x=0.01, ha="left", fontsize=13, fontweight="bold", color=INK)
    target = Path(path)
    write_aside(target, lambda aside: figure.savefig(aside, format="png"))
    return target


def _draw_num_envs(speed: Any, memory: Any, results: Sequence[tuple[ScalingResult, ScalingModel, int]]) -> None:
    dress(
        speed,
        f"Speed of one process with one thread{_correction(results)}",
        "environments in the process",
        "environment steps per second",
    )
    dress(memory, "Peak memory of one process", "environments in the process", "resident memory [MB]")
    for color, (result, _, _) in zip(COLORS, results, strict=False):
        points = result.sweep(NUM_ENVS)
        _draw_rates(speed, result, points, color, "-", "o", result.id)
        sizes = [point.num_envs for point in points]
        memory.plot(sizes, [point.memory / 1e6 for point in points], color=color, marker="o", markersize=5)
    for axis in (speed, memory):
        _log_sizes(axis, {point.num_envs for result, _, _ in results for point in result.sweep(NUM_ENVS)})
    speed.set_yscale("log")
    _count_ticks(speed)
    most = max(point.memory for result, _, _ in results for point in result.sweep(NUM_ENVS))
    memory.set_ylim(0, 1.15e-6 * most)
    speed.legend(frameon=False, fontsize=9, labelcolor=INK)


def _draw_side_by_side(axis: Any, results: Sequence[tuple[ScalingResult, ScalingModel, int]]) -> None:
    dress(
        axis,
        f"Speed against threads and processes{_correction(results)}",
        "threads or processes",
        "environment steps per second",
    )
    sizes: set[int] = set()
    named: set[str] = set()
    for color, (result, model, _) in zip(COLORS, results, strict=False):
        for sweep, (line, marker, label) in _STYLES.items():
            points = result.sweep(sweep)
            if points:
                _draw_rates(axis, result, points, color, line, marker, None)
                sizes |= {point.size for point in points}
                if label not in named:
                    axis.plot([], [], color=INK, linestyle=line, marker=marker, markersize=5, label=label)
                    named.add(label)
        most = max((point.processes for point in result.points), default=1)
        ideal = np.array([1, max(most, 2)])
        axis.plot(ideal, ideal * model.process_rate, color=color, linewidth=0.8, linestyle=":", zorder=1)
    axis.plot([], [], color=INK, linewidth=0.8, linestyle=":", label="ideal: n times the speed of one process")
    _log_sizes(axis, sizes)
    axis.set_yscale("log")
    _count_ticks(axis)
    axis.legend(frameon=False, fontsize=8, labelcolor=INK)


def _draw_prediction(axis: Any, results: Sequence[tuple[ScalingResult, ScalingModel, int]]) -> None:
    dress(axis, "Predicted speed on a cluster", "nodes", "environment steps per second")
    nodes = np.geomspace(1, 1000, 100)
    trained = False
    for color, (_, model, processes) in zip(COLORS, results, strict=False):
        axis.plot(nodes, [model.collected(count, processes) for count in nodes], color=color, linestyle=":")
        if model.learner is not None:
            trained = True
            axis.plot(nodes, [min(model.limits(count, processes).values()) for count in nodes], color=color)
    axis.plot([], [], color=INK, linestyle=":", label="collected by all processes")
    if trained:
        axis.plot([], [], color=INK, label="used by one training run")
    _log_sizes(axis, {1, 10, 100, 1000})
    axis.set_yscale("log")
    _count_ticks(axis)
    axis.legend(frameon=False, fontsize=8, labelcolor=INK)


def _draw_rates(
    axis: Any,
    result: ScalingResult,
    points: Sequence[ScalingPoint],
    color: str,
    line: str,
    marker: str,
    label: str | None,
) -> None:
    """Draw the median rate at each size, with error bars from the slowest to the fastest window.

    If other programs disturbed the measurement, the rates are corrected by the share of processor time.
    """
    sizes = [point.size for point in points]
    scales = np.array([1.0 / point.processor_share if result.is_disturbed else 1.0 for point in points])
    rates = scales * [point.steps_per_second for point in points]
    spread = (
        scales
        * np.array([[point.steps_per_second - point.low, point.high - point.steps_per_second] for point in points]).T
    )
    axis.errorbar(sizes, rates, yerr=spread, color=color, linestyle=line, marker=marker, markersize=5, linewidth=1.6,
                  elinewidth=1.0, capsize=2.5, label=label)  # fmt: skip


def _correction(results: Sequence[tuple[ScalingResult, ScalingModel, int]]) -> str:
    return ", corrected for other programs" if any(result.is_disturbed for result, _, _ in results) else ""


def _log_sizes(axis: Any, sizes: set[int]) -> None:
    """Set a logarithmic scale on the x axis, with a tick at each size."""
    axis.set_xscale("log")
    axis.set_xticks(sorted(sizes), [f"{size:,}" for size in sorted(sizes)])
    axis.minorticks_off()


def _count_ticks(axis: Any) -> None:
    """Label the logarithmic y axis at 1, 2 and 5 times each power of ten, so that even narrow ranges have labels."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.yaxis.set_major_formatter(lambda value, _: count_text(value))
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.tick_params(axis="y", which="minor", length=0)
