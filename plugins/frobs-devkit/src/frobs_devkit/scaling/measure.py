"""Runs all scaling measurements, one after another."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from frobs_core.plugins.registry import find_spec
from frobs_devkit.scaling.processes import measure_cluster, measure_processes
from frobs_devkit.scaling.ranges import ScalingRanges
from frobs_devkit.scaling.results import NUM_ENVS, PROCESSES, THREADS, ScalingPoint, ScalingResult
from frobs_devkit.timing import choose_num_envs, machine
from frobs_train import RunConfig, Runner, usable_processors


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
    """Return the configuration with the given numbers of environments and simulator threads."""
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
