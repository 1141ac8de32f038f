"""Numbers of environments, threads and processes, for which the scaling is measured one after another."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Self

from frobs_core.plugins.registry import find_spec
from frobs_core.util.validation import positive, whole_number
from frobs_devkit.scaling.processes import measure_cluster, measure_processes
from frobs_devkit.scaling.results import NUM_ENVS, PROCESSES, THREADS, ScalingPoint, ScalingResult
from frobs_devkit.timing import choose_num_envs, machine
from frobs_train import RunConfig, Runner, decide_threads, is_paced, usable_processors

_NUM_ENVS = (1, 8, 64, 512)


@dataclass(frozen=True, kw_only=True)
class ScalingRanges:
    """Sizes to measure. Empty ranges are skipped.

    Attributes:
        num_envs: Numbers of environments to measure in one process with one thread.
        threads: Numbers of simulator threads to measure in one process.
        processes: Numbers of processes to measure on this machine, each with one thread.
        cluster_processes: Numbers of processes to measure on a cluster, each with one thread.
        seconds: Measurement time per size [s]. Starting the processes takes a few additional seconds.
    """

    num_envs: tuple[int, ...] = _NUM_ENVS
    threads: tuple[int, ...] = ()
    processes: tuple[int, ...] = ()
    cluster_processes: tuple[int, ...] = ()
    seconds: float = 2.0

    def __post_init__(self) -> None:
        """Raise ConfigurationError if a number is out of range or ``num_envs`` is empty."""
        for name in ("num_envs", "threads", "processes", "cluster_processes"):
            for value in getattr(self, name):
                whole_number(name, value, lowest=1)
        positive("seconds", self.seconds, "s")
        whole_number("the number of sizes in num_envs", len(self.num_envs), lowest=1)

    @classmethod
    def choose(cls, config: RunConfig, **ranges: Any) -> Self:
        """Return the ranges. A range that is None or omitted is replaced with one that suits the environment.

        A paced simulator supports only a single environment. Environments of other libraries have no simulator threads.

        Args:
            config: Configuration of the environment.
            ranges: Values of the fields.
        """
        given = {name: value for name, value in ranges.items() if value is not None}
        sizes = powers_of_two(usable_processors())
        single = is_paced(config.environment_kwargs.get("simulator"))
        given.setdefault("num_envs", (1,) if single else _NUM_ENVS)
        without_threads = decide_threads(config).simulator is None or max(given["num_envs"]) == 1
        given.setdefault("threads", () if without_threads else sizes)
        given.setdefault("processes", sizes)
        return cls(**given)


def powers_of_two(highest: int) -> tuple[int, ...]:
    """Return all powers of two up to ``highest``, and ``highest`` itself."""
    return tuple(sorted({2**k for k in range(highest.bit_length())} | {highest}))


def bench_scaling(
    config: RunConfig,
    ranges: ScalingRanges | None = None,
    *,
    runner: Runner | None = None,
    folder: Path | None = None,
    on_step: Callable[[str], None] | None = None,
) -> ScalingResult:
    """Measure how speed and memory depend on the number of environments, threads, processes and nodes.

    Each measurement runs in new processes.

    Args:
        config: Configuration returned by :func:`frobs_train.resolve_config`.
        ranges: The sizes to measure. Defaults to sizes that suit the environment and this machine.
        runner: Runner that starts the processes of ``ranges.cluster_processes``.
        folder: Existing folder that has the same path on all machines of the cluster. Defaults to the current folder.
        on_step: Function that is called with a description of the next measurement, such as ``"64 environments"``.

    Raises:
        UnknownNameError: The environment ID does not exist.
        ConfigurationError: A setting is invalid, or the cluster does not run all processes.
    """
    find_spec(config.environment)
    load = os.getloadavg()[0]
    ranges = ranges or ScalingRanges.choose(config)
    say = on_step or (lambda _: None)
    config = config.model_copy(update={"reset_from": None})
    points: list[ScalingPoint] = []
    for size in ranges.num_envs:
        say(_count(size, "environment"))
        points.append(measure_processes(_with_size(config, size), NUM_ENVS, 1, ranges.seconds))
    busy = load > usable_processors() / 2  # then correct the speeds for the processor time of other programs
    num_envs = choose_num_envs({p.num_envs: p.undisturbed if busy else p.steps_per_second for p in points})
    config = _with_size(config, num_envs)
    each = f"{_count(num_envs, 'environment')} each"
    for size in ranges.threads:
        say(_count(size, "thread"))
        points.append(measure_processes(_with_size(config, num_envs, size), THREADS, 1, ranges.seconds))
    for size in ranges.processes:
        say(f"{_count(size, 'process')}, {each}")
        points.append(measure_processes(config, PROCESSES, size, ranges.seconds))
    memory = max(point.memory for point in points)
    if runner is not None and ranges.cluster_processes:
        for size in ranges.cluster_processes:
            say(f"{_count(size, 'process')} on the cluster, {each}")
            with TemporaryDirectory(prefix=".frobs-scaling-", dir=(folder or Path.cwd()).absolute()) as shared:
                points.append(measure_cluster(config, size, ranges.seconds, runner, Path(shared), memory))
    per_process, per_env = _fit_memory([point for point in points if point.sweep == NUM_ENVS])
    return ScalingResult(
        id=config.environment,
        points=tuple(points),
        num_envs=num_envs,
        memory_per_process=per_process,
        memory_per_env=per_env,
        machine=machine(),
        processors=usable_processors(),
        load=load,
    )


def _with_size(config: RunConfig, num_envs: int, threads: int = 1) -> RunConfig:
    keywords = {key: value for key, value in config.environment_kwargs.items() if key != "num_threads"}
    changed = config.threads.model_copy(update={"simulator": threads})
    return config.model_copy(update={"num_envs": num_envs, "threads": changed, "environment_kwargs": keywords})


def _fit_memory(points: list[ScalingPoint]) -> tuple[int, int | None]:
    """Return the memory use of a process without environments, and the additional memory use per environment [B]."""
    few, many = min(points, key=lambda point: point.num_envs), max(points, key=lambda point: point.num_envs)
    if few.num_envs == many.num_envs:
        return few.memory, None
    per_env = max(0.0, (many.memory - few.memory) / (many.num_envs - few.num_envs))
    return round(few.memory - few.num_envs * per_env), round(per_env)


def _count(number: int, name: str) -> str:
    plural = name + ("es" if name.endswith("s") else "s")
    return f"{number:,} {name if number == 1 else plural}"
