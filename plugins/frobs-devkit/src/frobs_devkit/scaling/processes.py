"""Measures processes that step environments at the same time, on this machine or on a cluster."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from frobs_core.util.errors import ConfigurationError
from frobs_core.util.plain import to_json
from frobs_devkit.scaling.results import CLUSTER, ScalingPoint
from frobs_train import Job, Report, RunConfig, Runner

_WINDOWS = 5  # number of time windows in a measurement. The result is the median over these windows
_PATIENCE = 120.0  # maximum time for all processes on this machine to start [s]
_CLUSTER_PATIENCE = 60.0  # maximum time between the starts of the first and the last process on a cluster [s]
_VARIABLES = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # NumPy's own threads would distort the measurement


def measure_processes(config: RunConfig, sweep: str, processes: int, seconds: float) -> ScalingPoint:
    """Measure processes on this machine that step environments at the same time, for some ``seconds``.

    The configuration's ``num_envs`` and ``threads`` apply to each process.
    """
    with TemporaryDirectory() as name:
        folder = Path(name)
        tasks = [_task(config, folder, index, processes, seconds, _PATIENCE) for index in range(processes)]
        with ExitStack() as stack:
            started = [stack.enter_context(_running(task)) for task in tasks]
            results = [_finish(process, task) for process, task in zip(started, tasks, strict=True)]
    return summarize(config, sweep, results, nodes=1, hosts=1)


def measure_cluster(
    config: RunConfig, processes: int, seconds: float, runner: Runner, folder: Path, memory: int
) -> ScalingPoint:
    """Measure processes on a cluster for some ``seconds``. Each process is a job with one processor and ``memory`` [B].

    ``num_envs`` and ``threads`` apply to each process. The empty ``folder`` has the same path on all machines.
    """
    jobs = []
    for index in range(processes):
        task = _task(config, folder.absolute(), index, processes, seconds, _CLUSTER_PATIENCE)
        jobs.append(Job(name=f"process {index}", function=f"{__name__}:run_worker", arguments=task, memory=memory))
    results: list[dict[str, Any]] = []
    for outcome in runner.run(jobs, folder):
        if outcome.error is not None:
            raise ConfigurationError(
                f"cannot measure {processes} process{'es' if processes > 1 else ''} on the cluster: {outcome.error}"
            )
        results.append(outcome.result)
    nodes = {result["node"] for result in results}
    return summarize(config, CLUSTER, results, nodes=len(nodes), hosts=len({host for host, _ in nodes}))


def run_worker(report: Report, **task: Any) -> dict[str, Any]:
    """Measure one process, as a job of :func:`measure_cluster`.

    The measured process is a new process that does not load the cluster's libraries.
    """
    with _running(task) as process:
        return {**_finish(process, task), "node": node()}


def node() -> tuple[str, int]:
    """Return the host name and the parent process ID, which are the same for all jobs on a node."""
    return platform.node(), os.getppid()


def summarize(
    config: RunConfig, sweep: str, results: Sequence[Mapping[str, Any]], *, nodes: int, hosts: int
) -> ScalingPoint:
    """Combine the results of several processes into one data point."""
    rates = window_rates([result["stamps"] for result in results])
    threads = config.threads.simulator or 1
    return ScalingPoint(
        sweep=sweep,
        num_envs=config.total_envs,
        threads=threads,
        processes=len(results),
        nodes=nodes,
        hosts=hosts,
        steps_per_second=median(rates),
        low=min(rates),
        high=max(rates),
        processor_share=sum(result["processors"] for result in results) / len(results) / threads,
        memory=max(result["memory"] for result in results),
        startup=max(result["startup"] for result in results),
    )


def window_rates(stamps: Sequence[Sequence[tuple[float, int]]], windows: int = _WINDOWS) -> list[float]:
    """Return the total steps per second of all processes, in each of several time windows.

    The windows divide the time during which all processes were stepping. There are fewer if steps are slow, so that
    each window contains a step. Each process has stamps: pairs of a time [s] and the number of steps completed by then.
    """
    begin, end = max(each[0][0] for each in stamps), min(each[-1][0] for each in stamps)
    longest = max(float(np.max(np.diff([moment for moment, _ in each]))) for each in stamps)
    count = max(1, min(windows, int((end - begin) / longest)))
    edges = np.linspace(begin, end, count + 1)
    steps = np.zeros(count + 1)
    for each in stamps:
        moments, totals = (np.array(column, dtype=float) for column in zip(*each, strict=True))
        steps += np.interp(edges, moments, totals)
    return [float(rate) for rate in np.diff(steps) / np.diff(edges)]


def _task(config: RunConfig, folder: Path, index: int, count: int, seconds: float, patience: float) -> dict[str, Any]:
    return {
        "config": config.model_dump(mode="json"),
        "folder": str(folder),
        "index": index,
        "count": count,
        "seconds": seconds,
        "patience": patience,
    }


@contextmanager
def _running(task: Mapping[str, Any]) -> Iterator[subprocess.Popen[str]]:
    """Start the process of a task, and kill it at the end of the ``with`` block if it is still running."""
    process = subprocess.Popen(
        [sys.executable, "-m", "frobs_devkit.scaling.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **_VARIABLES},
    )
    assert process.stdin is not None
    process.stdin.write(to_json({**task, "launched": time.time()}))
    process.stdin.close()
    process.stdin = None  # communicate() would close it again
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        if process.stderr is not None:
            process.stderr.close()


def _finish(process: subprocess.Popen[str], task: Mapping[str, Any]) -> dict[str, Any]:
    _, stderr = process.communicate()
    folder, index = Path(task["folder"]), task["index"]
    if process.returncode == 0:
        result: dict[str, Any] = json.loads((folder / f"result-{index}.json").read_text("utf-8"))
        return result
    files = sorted(folder.glob("error-*"))
    lines = [line for line in stderr.splitlines() if line.strip()]
    if files:
        raise ConfigurationError(files[0].read_text("utf-8"))
    cause = lines[-1] if lines else f"it ended with status {process.returncode}"
    raise ConfigurationError(f"a process that steps {task['config']['num_envs']} environments failed: {cause}")
