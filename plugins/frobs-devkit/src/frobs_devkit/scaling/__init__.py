"""Measures how an environment's speed grows with the number of environments, threads, processes and nodes.

ranges.py      the sizes to measure
results.py     the results of the measurements
measure.py     runs all measurements
processes.py   measures processes that step environments at the same time, on this machine or on a cluster
worker.py      the program of each of these processes
traffic.py     measures how fast a learner receives experience from a cluster
model.py       a model of the speed that is fitted to the measurements, and its predictions
plots.py       the plot
"""

from frobs_devkit.scaling.measure import bench_scaling
from frobs_devkit.scaling.model import Prediction, ScalingModel, fit_model
from frobs_devkit.scaling.plots import plot_scaling
from frobs_devkit.scaling.ranges import ScalingRanges
from frobs_devkit.scaling.results import LearnerCosts, ScalingPoint, ScalingResult, Traffic

__all__ = [
    "LearnerCosts",
    "Prediction",
    "ScalingModel",
    "ScalingPoint",
    "ScalingRanges",
    "ScalingResult",
    "Traffic",
    "bench_scaling",
    "fit_model",
    "plot_scaling",
]
