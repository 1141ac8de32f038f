"""Measures how an environment's speed grows with the number of environments, threads, processes and nodes.

results.py     the results of the measurements
measure.py     the sizes to measure, and all measurements
processes.py   measures processes that step environments at the same time, on this machine or on a cluster
worker.py      the program of each of these processes
plots.py       the plot
"""

from frobs_devkit.scaling.measure import ScalingRanges, bench_scaling
from frobs_devkit.scaling.plots import plot_scaling
from frobs_devkit.scaling.results import ScalingPoint, ScalingResult

__all__ = [
    "ScalingPoint",
    "ScalingRanges",
    "ScalingResult",
    "bench_scaling",
    "plot_scaling",
]
