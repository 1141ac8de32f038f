"""Runs all scaling measurements, one after another."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from frobs_core.plugins.registry import find_spec
from frobs_devkit.scaling.processes import measure_cluster, measure_learner, measure_processes
from frobs_devkit.scaling.ranges import ScalingRanges
from frobs_devkit.scaling.results import NUM_ENVS, PROCESSES, THREADS, ScalingPoint, ScalingResult
from frobs_devkit.scaling.traffic import measure_traffic
from frobs_devkit.timing import machine
from frobs_train import RunConfig, Runner, usable_processors

_ENOUGH = 0.9
"""A number of environments is fast enough if it reaches this fraction of the best measured speed."""


def bench_scaling(
    config: RunConfig,
    ranges: ScalingRanges | None = None,
    *,
    runner: Runner | None = None,
    learner: bool = False,
    folder: Path | None = None,
    on_step: Callable[[str], None] | None = None,
) -> ScalingResult:
    """Measure how speed and memory depend on the number of environments, threads, processes and nodes.

    Each measurement runs in new processes.

    Args:
        config: Configuration returned by :func:`frobs_train.resolve_config`.
        ranges: The sizes to measure. Defaults to sizes that suit the environment and this machine.
        runner: Runner that starts the processes of ``ranges.cluster_processes``.
        learner: Whether to measure a short training run as well, which is required to predict training times.
        folder: Existing folder that has the same path on all machines of the cluster. Defaults to the current folder.
        on_step: Function that is called with a description of the next measurement, such as ``"64 environments"``.

    Raises:
        UnknownNameError: The environment ID or the algorithm does not exist.
        ConfigurationError: A setting is invalid, or the cluster does not run all processes.
    """
    find_spec(config.environment)
    load = os.getloadavg()[0]
    ranges = ranges or ScalingRanges.choose(config)
    say = on_step or (lambda _: None)
    training = _with_size(config, config.num_envs)
    config = config.model_copy(update={"reset_from": None})
    points: list[ScalingPoint] = []
    for size in ranges.num_envs:
        say(_count(size, "environment"))
        points.append(measure_processes(_with_size(config, size), NUM_ENVS, 1, ranges.seconds))
    num_envs = _choose_num_envs(points, busy=load > usable_processors() / 2)
    config = _with_size(config, num_envs)
    each = f"{_count(num_envs, 'environment')} each"
    for size in ranges.threads:
        say(_count(size, "thread"))
        points.append(measure_processes(_with_size(config, num_envs, size), THREADS, 1, ranges.seconds))
    for size in ranges.processes:
        say(f"{_count(size, 'process')}, {each}")
        points.append(measure_processes(config, PROCESSES, size, ranges.seconds))
    memory = max(point.memory for point in points)
    traffic = None
    if runner is not None and ranges.cluster_processes:
        for size in ranges.cluster_processes:
            say(f"{_count(size, 'process')} on the cluster, {each}")
            with _shared(folder) as shared:
                points.append(measure_cluster(config, size, ranges.seconds, runner, shared, memory))
        say("batches from the cluster")
        with _shared(folder) as shared:
            traffic = measure_traffic(config, runner, shared, memory)
    costs = None
    if learner:
        say(f"a training run with {config.algorithm}")
        costs = measure_learner(training)
    per_process, per_env = _fit_memory([point for point in points if point.sweep == NUM_ENVS])
    return ScalingResult(
        id=config.environment,
        points=tuple(points),
        num_envs=num_envs,
        memory_per_process=per_process,
        memory_per_env=per_env,
        traffic=traffic,
        learner=costs,
        machine=machine(),
        processors=usable_processors(),
        load=load,
    )


def _with_size(config: RunConfig, num_envs: int, threads: int = 1) -> RunConfig:
    """Return the configuration with the given numbers of environments and simulator threads."""
    keywords = {key: value for key, value in config.environment_kwargs.items() if key != "num_threads"}
    changed = config.threads.model_copy(update={"simulator": threads})
    return config.model_copy(update={"num_envs": num_envs, "threads": changed, "environment_kwargs": keywords})


def _choose_num_envs(points: list[ScalingPoint], *, busy: bool) -> int:
    """Return the smallest number of environments that is fast enough.

    On a busy machine, the speeds are corrected for the processor time that other programs use.
    """
    rates = {point.num_envs: point.undisturbed if busy else point.steps_per_second for point in points}
    return min(size for size, rate in rates.items() if rate >= _ENOUGH * max(rates.values()))


def _fit_memory(points: list[ScalingPoint]) -> tuple[int, int | None]:
    """Return the memory use of a process without environments, and the additional memory use per environment [B]."""
    few, many = min(points, key=lambda point: point.num_envs), max(points, key=lambda point: point.num_envs)
    if few.num_envs == many.num_envs:
        return few.memory, None
    per_env = max(0.0, (many.memory - few.memory) / (many.num_envs - few.num_envs))
    return round(few.memory - few.num_envs * per_env), round(per_env)


@contextmanager
def _shared(folder: Path | None) -> Iterator[Path]:
    """Create a temporary folder that all machines of the cluster can access."""
    with TemporaryDirectory(prefix=".frobs-scaling-", dir=(folder or Path.cwd()).absolute()) as name:
        yield Path(name)


def _count(number: int, name: str) -> str:
    plural = name + ("es" if name.endswith("s") else "s")
    return f"{number:,} {name if number == 1 else plural}"
