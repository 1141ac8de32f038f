"""Results of the scaling measurements."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

NUM_ENVS, THREADS, PROCESSES, CLUSTER = "num_envs", "threads", "processes", "cluster"
"""Names of the sweeps, each of which varies one size."""


_UNDISTURBED = 0.8  # minimum ratio of processor time to elapsed time at which a process is considered undisturbed


@dataclass(frozen=True, kw_only=True)
class ScalingPoint:
    """Measured speed and memory use for one size, such as 64 environments.

    Attributes:
        sweep: Size that the sweep varies: ``num_envs``, ``threads``, ``processes`` or ``cluster`` processes.
        num_envs: Number of environments in each process.
        threads: Number of simulator threads in each process.
        processes: Number of processes that step environments at the same time.
        nodes: Number of cluster nodes that run the processes, or 1 for this machine.
        hosts: Number of machines that run the processes, which is less than ``nodes`` if several nodes share a machine.
        steps_per_second: Total environment steps per second across all processes (median of several time windows).
        low: Rate in the slowest window [steps/s].
        high: Rate in the fastest window [steps/s].
        processor_share: Processor time per thread ÷ elapsed time. The ratio is less than 1 if other programs use the
            processors, or if the simulator waits or runs as a separate program.
        memory: Peak resident memory of the process with the largest peak [B].
        startup: Startup time of the slowest process, including imports and the creation of the environments [s].
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
        """Estimated environment steps per second if each thread had a processor to itself."""
        return self.steps_per_second / self.processor_share

    @property
    def size(self) -> int:
        """Value of the varied size, such as the number of environments in a sweep over environments."""
        return {NUM_ENVS: self.num_envs, THREADS: self.threads}.get(self.sweep, self.processes)


@dataclass(frozen=True, kw_only=True)
class ScalingResult:
    """Results of :func:`bench_scaling`.

    Attributes:
        id: The environment's ID.
        points: Speed and memory for each measured size.
        num_envs: Number of environments per process in the sweeps over threads and processes: the smallest measured
            number that reaches 90 % of the best speed with one thread.
        memory_per_process: Estimated memory of a process without environments [B].
        memory_per_env: Memory of each additional environment [B], or None if there was only one size.
        machine: Processor, operating system and Python.
        processors: Number of processors available to the measurement.
        load: Average number of runnable processes in the minute before the measurement.
    """

    id: str
    points: tuple[ScalingPoint, ...]
    num_envs: int
    memory_per_process: int
    memory_per_env: int | None
    machine: str
    processors: int
    load: float

    @property
    def is_disturbed(self) -> bool:
        """Whether other programs used a large share of the processors during the measurement."""
        share = min(point.processor_share for point in self.points)
        return self.load > self.processors / 2 and share < _UNDISTURBED

    @property
    def startup(self) -> float:
        """Median startup time of a process [s]."""
        return median(point.startup for point in self.points)

    def sweep(self, name: str) -> list[ScalingPoint]:
        """Return the points of the sweep ``name`` in ascending order of size."""
        return sorted((point for point in self.points if point.sweep == name), key=lambda point: point.size)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON-compatible values."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> ScalingResult:
        """Create a result from the values of :meth:`to_dict`, ignoring unknown keys."""
        known = {key: values[key] for key in cls.__dataclass_fields__}
        return cls(**known | {"points": tuple(ScalingPoint(**point) for point in known["points"])})
