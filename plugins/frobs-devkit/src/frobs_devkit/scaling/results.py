"""Results of the measurements of scaling."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

NUM_ENVS, THREADS, PROCESSES, CLUSTER = "num_envs", "threads", "processes", "cluster"
"""The sweeps: each varies one size."""


_UNDISTURBED = 0.8
"""Share of a processor from which a process counts as undisturbed."""


@dataclass(frozen=True, kw_only=True)
class ScalingPoint:
    """The speed and memory of one size.

    Attributes:
        sweep: The size that varies: ``num_envs``, ``threads``, ``processes`` or ``cluster`` (processes on a cluster).
        num_envs: Environments in each process.
        threads: Simulator threads in each process.
        processes: Processes that step at the same time.
        nodes: Nodes of the cluster on which they run; 1 for this machine.
        hosts: Machines on which they run. Less than ``nodes`` if several nodes share a machine.
        steps_per_second: Environment steps per second of all processes: median of several windows.
        low: Slowest window [steps/s].
        high: Fastest window [steps/s].
        processor_share: Processor time of each thread ÷ time. Less than 1 if other programs use the processors, or if the
            simulator is a program of its own or waits.
        memory: Peak resident memory of a process [B]: the largest of all processes.
        startup: Time to import the libraries and make the environments [s]: the longest of all processes.
    """

    sweep: str
    num_envs: int
    threads: int
    processes: int
    nodes: int
    hosts: int
    steps_per_second: float
    low: float
    high: float
    processor_share: float
    memory: int
    startup: float

    @property
    def undisturbed(self) -> float:
        """Return the environment steps per second that a whole processor for each thread would allow."""
        return self.steps_per_second / self.processor_share

    @property
    def size(self) -> int:
        """Return the size that the sweep varies."""
        return {NUM_ENVS: self.num_envs, THREADS: self.threads}.get(self.sweep, self.processes)


@dataclass(frozen=True, kw_only=True)
class Traffic:
    """How fast a learner receives experience from the processes that collect it.

    Attributes:
        bytes_per_step: Size of observation, action, reward and ends of episodes of one environment step [B].
        bytes_per_second: Rate at which this process receives batches, copying included [B/s].
        hosts: Machines that sent batches. If all ran on this machine, no network was measured.
    """

    bytes_per_step: float
    bytes_per_second: float
    hosts: tuple[str, ...]

    @property
    def steps_per_second(self) -> float:
        """Return how many environment steps the learner can receive per second."""
        return self.bytes_per_second / self.bytes_per_step


@dataclass(frozen=True, kw_only=True)
class LearnerCosts:
    """Times of a training run in one process, per environment step.

    Attributes:
        algorithm: Name of the algorithm.
        inference: Time to choose an action [s].
        learning: Time of updates, storage and everything else that a central learner does [s].
        total: Time of a whole step of the training run, simulation included [s].
        processor_share: Processor time ÷ time, at most 1.
    """

    algorithm: str
    inference: float
    learning: float
    total: float
    processor_share: float


@dataclass(frozen=True, kw_only=True)
class ScalingResult:
    """Results of :func:`bench_scaling`.

    Attributes:
        id: The environment's ID.
        points: Speed and memory at each size.
        num_envs: Environments per process in the sweeps over threads and processes: the smallest measured number that
            reaches 90 % of the best speed with one thread.
        memory_per_process: Estimated memory of a process without environments [B].
        memory_per_env: Memory of each further environment [B]; None: a single number of environments was measured.
        traffic: How fast a learner receives experience; None: no cluster was measured.
        learner: Times of a training run; None: not measured.
        machine: Processor, operating system and Python.
        processors: Processors that the measurement could use.
        load: Processes that wanted a processor before the measurement: average over a minute.
    """

    id: str
    points: tuple[ScalingPoint, ...]
    num_envs: int
    memory_per_process: int
    memory_per_env: int | None
    traffic: Traffic | None
    learner: LearnerCosts | None
    machine: str
    processors: int
    load: float

    @property
    def is_disturbed(self) -> bool:
        """Return whether other programs took much of the processors during the measurement."""
        share = min(point.processor_share for point in self.points)
        return self.load > self.processors / 2 and share < _UNDISTURBED

    def sweep(self, name: str) -> list[ScalingPoint]:
        """Return the points of a sweep, the smallest size first."""
        return sorted((point for point in self.points if point.sweep == name), key=lambda point: point.size)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> ScalingResult:
        """Return the result that :meth:`to_dict` describes; other keys are ignored."""
        known = {key: values[key] for key in cls.__dataclass_fields__}
        traffic, learner = known["traffic"], known["learner"]
        return cls(
            **known
            | {
                "points": tuple(ScalingPoint(**point) for point in known["points"]),
                "traffic": traffic and Traffic(**traffic | {"hosts": tuple(traffic["hosts"])}),
                "learner": learner and LearnerCosts(**learner),
            }
        )
