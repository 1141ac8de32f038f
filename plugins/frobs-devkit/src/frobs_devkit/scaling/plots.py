"""Plots speed and memory against the number of environments, threads, processes and nodes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.files import write_aside
from frobs_devkit.scaling.results import CLUSTER, NUM_ENVS, PROCESSES, THREADS, ScalingResult
from frobs_train import COLORS, INK, count_text, dress, make_figure

_STYLES = {
    THREADS: ("--", "s", "threads of one process"),
    PROCESSES: ("-", "o", "processes on one machine"),
    CLUSTER: ("-.", "D", "processes on a cluster"),
}


def plot_scaling(results: Sequence[ScalingResult], path: Path | str) -> Path:
    """Plot measurements as a PNG image.

    Args:
        results: Measurements of each environment.
        path: PNG file to write.

    Returns:
        Path of the PNG file.

    Raises:
        RunError: matplotlib is not installed.
    """
    figure = make_figure(16.0, 4.4)
    speed, memory, side_by_side = figure.subplots(1, 3)
    _draw_num_envs(speed, memory, results)
    _draw_side_by_side(side_by_side, results)
    names = " and ".join(result.id for result in results)
    figure.suptitle(f"Scaling of {names}", x=0.01, ha="left", fontsize=13, fontweight="bold", color=INK)
    target = Path(path)
    write_aside(target, lambda aside: figure.savefig(aside, format="png"))
    return target


def _draw_num_envs(speed: Any, memory: Any, results: Sequence[ScalingResult]) -> None:
    title, size = f"Speed of one process with one thread{_correction(results)}", "environments in the process"
    dress(speed, title, size, "environment steps per second")
    dress(memory, "Peak memory of one process", size, "resident memory [MB]")
    for color, result in zip(COLORS, results, strict=False):
        points = result.sweep(NUM_ENVS)
        _draw_rates(speed, result, NUM_ENVS, color, "-", "o", result.id)
        sizes = [point.num_envs for point in points]
        memory.plot(sizes, [point.memory / 1e6 for point in points], color=color, marker="o", markersize=5)
    for axis in (speed, memory):
        _log_sizes(axis, {point.num_envs for result in results for point in result.sweep(NUM_ENVS)})
    speed.set_yscale("log")
    _count_ticks(speed)
    most = max(point.memory for result in results for point in result.sweep(NUM_ENVS))
    memory.set_ylim(0, 1.15e-6 * most)
    speed.legend(frameon=False, fontsize=9, labelcolor=INK)


def _draw_side_by_side(axis: Any, results: Sequence[ScalingResult]) -> None:
    title = f"Speed against threads and processes{_correction(results)}"
    dress(axis, title, "threads or processes", "environment steps per second")
    sizes: set[int] = set()
    named: set[str] = set()
    for color, result in zip(COLORS, results, strict=False):
        for sweep, (line, marker, label) in _STYLES.items():
            points = result.sweep(sweep)
            if points:
                _draw_rates(axis, result, sweep, color, line, marker, None)
                sizes |= {point.size for point in points}
                if label not in named:
                    axis.plot([], [], color=INK, linestyle=line, marker=marker, markersize=5, label=label)
                    named.add(label)
        most = max((point.processes for point in result.points), default=1)
        ideal = np.array([1, max(most, 2)])
        axis.plot(ideal, ideal * _process_rate(result), color=color, linewidth=0.8, linestyle=":", zorder=1)
    axis.plot([], [], color=INK, linewidth=0.8, linestyle=":", label="ideal: n times the speed of one process")
    _log_sizes(axis, sizes)
    axis.set_yscale("log")
    _count_ticks(axis)
    axis.legend(frameon=False, fontsize=8, labelcolor=INK)


def _process_rate(result: ScalingResult) -> float:
    points = (*result.sweep(PROCESSES), *result.sweep(NUM_ENVS))
    single = next(point for point in points if point.processes == 1 and point.num_envs == result.num_envs)
    return single.undisturbed if result.is_disturbed else single.steps_per_second


def _draw_rates(
    axis: Any, result: ScalingResult, sweep: str, color: str, line: str, marker: str, label: str | None
) -> None:
    """Draw the median rate at each size, with error bars from the slowest to the fastest window.

    If other programs disturbed the measurement, the rates are corrected by the share of processor time.
    """
    points = result.sweep(sweep)
    sizes = [point.size for point in points]
    scales = np.array([1.0 / point.processor_share if result.is_disturbed else 1.0 for point in points])
    rates = scales * [point.steps_per_second for point in points]
    ends = np.array([(point.low, point.high) for point in points]).T
    spread = np.abs(scales * ends - rates)
    axis.errorbar(sizes, rates, yerr=spread, color=color, linestyle=line, marker=marker, markersize=5, linewidth=1.6,
                  elinewidth=1.0, capsize=2.5, label=label)  # fmt: skip


def _correction(results: Sequence[ScalingResult]) -> str:
    return ", corrected for other programs" if any(result.is_disturbed for result in results) else ""


def _log_sizes(axis: Any, sizes: set[int]) -> None:
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
