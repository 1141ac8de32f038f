"""A model of the speed on a cluster, fitted to measurements.

With n nodes and p processes per node, the predicted rate of environment steps is C(n, p):

    C(n, p) = n · p · s / ((1 + α (p - 1)) (1 + β (n - 1)))

Here, s is the rate of a single process, α is the contention between processes on the same node (memory, caches, clock
rate), and β is the contention between nodes. This is the Universal Scalability Law without its coherency term, as
described in Neil Gunther's book Guerrilla Capacity Planning, Springer 2007, chapter 4. The rate of a training run is
also limited by how fast its learner can receive the experience and learn from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from frobs_core.util.errors import ConfigurationError
from frobs_core.util.validation import non_negative, positive, whole_number
from frobs_devkit.scaling.results import CLUSTER, NUM_ENVS, PROCESSES, LearnerCosts, ScalingPoint, ScalingResult

COLLECTION, LEARNER, NETWORK = "collection", "learner", "network"
"""Possible bottlenecks of a training run."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Predicted speed, time and cost for a number of nodes.

    Attributes:
        nodes: Number of nodes.
        processes: Number of processes on all nodes, with one process per processor.
        collected: Total environment steps per second of all processes, without learning.
        steps_per_second: Environment steps per second of a training run whose processes all collect experience for one
            learner, or None if no training run was measured.
        limit: Bottleneck of this training run: ``collection``, ``learner`` or ``network``, or None if no training run
            was measured.
        seconds: Time of the training run, including the startup [s].
        node_hours: Number of nodes × duration of the training run [h].
        cost: Node-hours × price, or None if no price is given.
        runs_per_hour: Number of independent training runs, such as seeds or trials, that finish per hour on all nodes.
            Each training run uses one process.
    """

    nodes: int
    processes: int
    collected: float
    steps_per_second: float | None
    limit: str | None
    seconds: float | None
    node_hours: float | None
    cost: float | None
    runs_per_hour: float | None


@dataclass(frozen=True, kw_only=True)
class ScalingModel:
    """Parameters and prediction errors of the scaling model.

    The prediction errors are determined by fitting the model without the largest size and predicting the rate at this
    size.

    Attributes:
        process_rate: s, the environment steps per second of a single process.
        process_contention: α, the contention between processes on the same node, at least 0.
        node_contention: β, the contention between nodes, at least 0.
        node_contention_measured: Whether β was measured on several machines. Otherwise, β is assumed to be 0.
        startup: Time to start a process [s].
        learner: Times of a training run in one process, or None if no training run was measured.
        bytes_per_step: Size of the experience from one environment step [B], or None if it was not measured.
        bandwidth: Maximum rate at which the learner receives experience [B/s], or None if unlimited.
        process_error: Predicted ÷ measured rate − 1 at the largest number of processes on this machine, or None if
            fewer than two numbers of processes were measured.
        cluster_error: Predicted ÷ measured rate − 1 at the largest number of nodes, or None if fewer than two numbers
            of nodes were measured.
        corrected: Whether other programs disturbed the measurement. In this case, the model is fitted to the rates and
            times expected without other programs: rate ÷ share of processor time, and time × share of processor time.
    """

    process_rate: float
    process_contention: float
    node_contention: float = 0.0
    node_contention_measured: bool = False
    startup: float = 0.0
    learner: LearnerCosts | None = None
    bytes_per_step: float | None = None
    bandwidth: float | None = None
    process_error: float | None = None
    cluster_error: float | None = None
    corrected: bool = False

    def collected(self, nodes: float, processes: float) -> float:
        """Return the total environment steps per second of all processes.

        Args:
            nodes: Number of nodes.
            processes: Number of processes per node.
        """
        return nodes * processes * self.process_rate / self._loss(nodes, processes)

    def limits(self, nodes: float, processes: float) -> dict[str, float]:
        """Return the maximum rate that each part of a training run permits [environment steps/s].

        The collecting processes also choose the actions. The learner does everything else.

        Args:
            nodes: Number of nodes.
            processes: Number of processes per node.
        """
        speeds = {}
        if self.learner is not None:
            slowed = self.process_rate / (1.0 + self.process_rate * self.learner.inference)
            speeds[COLLECTION] = self.collected(nodes, processes) * slowed / self.process_rate
            speeds[LEARNER] = 1.0 / self.learner.learning
            if self.bandwidth is not None and self.bytes_per_step is not None:
                speeds[NETWORK] = self.bandwidth / self.bytes_per_step
        return speeds

    def predict(self, nodes: int, processes: int, steps: int, price: float | None = None) -> Prediction:
        """Predict the speed, time and cost of a training run.

        Args:
            nodes: Number of nodes.
            processes: Number of processes per node.
            steps: Number of environment steps in the training run.
            price: Price of a node per hour, in any currency. Without a price, no cost is predicted.

        Raises:
            ConfigurationError: A number is out of range.
        """
        whole_number("nodes", nodes, lowest=1)
        whole_number("processes", processes, lowest=1)
        whole_number("steps", steps, lowest=1)
        price = None if price is None else non_negative("price", price)
        limits = self.limits(nodes, processes)
        bare = Prediction(
            nodes=nodes,
            processes=nodes * processes,
            collected=self.collected(nodes, processes),
            steps_per_second=None,
            limit=None,
            seconds=None,
            node_hours=None,
            cost=None,
            runs_per_hour=None,
        )
        if self.learner is None:
            return bare
        limit = min(limits, key=lambda name: limits[name])
        seconds = self.startup + steps / limits[limit]
        node_hours = nodes * seconds / 3600.0
        alone = self.startup + steps * self.learner.total * self._loss(nodes, processes)
        return replace(
            bare,
            steps_per_second=limits[limit],
            limit=limit,
            seconds=seconds,
            node_hours=node_hours,
            cost=None if price is None else node_hours * price,
            runs_per_hour=nodes * processes * 3600.0 / alone,
        )

    def _loss(self, nodes: float, processes: float) -> float:
        """Return the factor by which contention slows down each process."""
        return (1.0 + self.process_contention * (processes - 1)) * (1.0 + self.node_contention * (nodes - 1))


def fit_model(result: ScalingResult, *, bandwidth: float | None = None) -> ScalingModel:
    """Fit the model to measurements.

    Args:
        result: Measurements from :func:`frobs_devkit.scaling.bench_scaling`.
        bandwidth: Network bandwidth of the learner's machine [B/s]. Defaults to the measured rate if the cluster has
            several machines, and to no limit otherwise.

    Raises:
        ConfigurationError: There is no measurement to fit the model to, or the bandwidth is not positive.
    """
    if bandwidth is not None:
        positive("bandwidth", bandwidth, "B/s")
    corrected = result.is_disturbed

    def rate_of(point: ScalingPoint) -> float:
        return point.undisturbed if corrected else point.steps_per_second

    learner = result.learner
    if corrected and learner is not None:
        share = learner.processor_share
        learner = replace(
            learner,
            inference=learner.inference * share,
            learning=learner.learning * share,
            total=learner.total * share,
        )
    single = [point for point in result.sweep(NUM_ENVS) if point.num_envs == result.num_envs]
    local = [(point.processes, rate_of(point)) for point in result.sweep(PROCESSES) or single]
    if not local:
        raise ConfigurationError(
            "no scaling model can be fitted, because the speed was not measured for any number of processes; measure "
            "at least one number of processes."
        )
    rate, contention = fit_contention(local)
    model = ScalingModel(
        process_rate=rate,
        process_contention=contention,
        startup=median(point.startup for point in result.points),
        learner=learner,
        corrected=corrected,
        process_error=_error_without_largest(local),
    )
    cluster = result.sweep(CLUSTER)
    if cluster:
        points = [(point.nodes, point.processes / point.nodes, rate_of(point)) for point in cluster]
        if max(point.hosts for point in cluster) > 1:
            rate, between = _fit_nodes(points, contention)
            model = replace(model, process_rate=rate, node_contention=between, node_contention_measured=True)
        model = replace(model, cluster_error=_error_without_most_nodes(points, contention))
    traffic = result.traffic
    if traffic is not None:
        sent = len(traffic.hosts) > 1
        model = replace(
            model,
            bytes_per_step=traffic.bytes_per_step,
            bandwidth=bandwidth or (traffic.bytes_per_second if sent else None),
        )
    return model


def fit_contention(points: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Fit X(k) = k s / (1 + α (k - 1)) to points by minimizing the relative errors.

    k / X is linear in k - 1, so this is a linear least-squares problem.

    Args:
        points: Pairs of size k and rate X. If all pairs have the same size, α is 0.

    Returns:
        s and α, with α ≥ 0.
    """
    sizes, rates = (np.array(column, dtype=float) for column in zip(*points, strict=True))
    inverse = sizes / rates  # time per step of each of the k processes or nodes
    if len(set(sizes)) > 1:
        system = np.stack([1.0 / inverse, (sizes - 1.0) / inverse], axis=1)  # (points, 2)
        (alone, slope), *_ = np.linalg.lstsq(system, np.ones(len(sizes)), rcond=None)
        if slope > 0.0 and alone > 0.0:
            return float(1.0 / alone), float(slope / alone)
    return float(np.mean(1.0 / inverse)), 0.0


def _fit_nodes(points: Sequence[tuple[float, float, float]], contention: float) -> tuple[float, float]:
    """Return s and β, fitted to points of the form (nodes, processes per node, rate)."""
    return fit_contention([(nodes, rate * (1.0 + contention * (each - 1)) / each) for nodes, each, rate in points])


def _error_without_largest(points: Sequence[tuple[float, float]]) -> float | None:
    """Fit all sizes except the largest, and return the relative prediction error at the largest size."""
    largest = max(size for size, _ in points)
    rest = [point for point in points if point[0] < largest]
    if not rest:
        return None
    rate, contention = fit_contention(rest)
    measured = np.mean([rate for size, rate in points if size == largest])
    return float(largest * rate / (1.0 + contention * (largest - 1)) / measured - 1.0)


def _error_without_most_nodes(points: Sequence[tuple[float, float, float]], contention: float) -> float | None:
    """Fit all numbers of nodes except the largest, and return the relative prediction error at the largest number."""
    scaled = [(nodes, rate * (1.0 + contention * (each - 1)) / each) for nodes, each, rate in points]
    return _error_without_largest(scaled)
