"""Measures how fast a learner receives experience that other processes have collected.

Some jobs collect a batch and return it, like the workers of an asynchronous algorithm. Other jobs return nothing. The
time to transfer a batch is the difference between the delays of jobs that return a batch and jobs that return nothing.
This difference is not affected by latency or by clock differences between machines.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from frobs_core.util.errors import ConfigurationError
from frobs_devkit.scaling.processes import node
from frobs_devkit.scaling.results import Traffic
from frobs_train import Job, Report, RunConfig, Runner

_ROUNDS = 3
"""Number of jobs that return a batch. The same number of jobs return nothing."""

_BATCH = 32 * 2**20
"""Size of a batch [B], large enough to make the latency negligible."""

_STEPS = 16
"""Number of environment steps to collect. The data from these steps is repeated to fill the batch."""

_PATIENCE = 60.0  # [s]


def measure_traffic(config: RunConfig, runner: Runner, folder: Path, memory: int) -> Traffic:
    """Measure how fast this process receives batches from the processes of a cluster.

    Args:
        config: Configuration whose ``num_envs`` is the number of environments per process.
        runner: Runner that executes the jobs.
        folder: Empty folder that has the same path on all machines.
        memory: Memory required by each process [B].

    Raises:
        ConfigurationError: The environments cannot be created.
    """
    arguments = {"config": config.model_dump(mode="json"), "folder": folder.absolute()}
    jobs = [
        Job(
            name=f"batch {index}",
            function=f"{__name__}:return_batch",
            arguments={**arguments, "size": _BATCH * (index % 2)},
            memory=memory + 2 * _BATCH,
        )
        for index in range(2 * _ROUNDS)
    ]
    empty: list[float] = []
    full: list[tuple[float, int]] = []  # delay [s] and size [B]
    bytes_per_step, hosts = 0.0, set()
    for outcome in runner.run(jobs, folder):
        if outcome.error is not None:
            raise ConfigurationError(f"the traffic on the cluster cannot be measured: {outcome.error}")
        answer = outcome.result
        copies = [array.copy() for array in answer["batch"]]  # the time includes copying, as in a learner
        delay = time.time() - answer["finished"]
        _lock(folder).rmdir()
        if copies:
            full.append((delay, sum(array.nbytes for array in copies)))
            bytes_per_step = answer["bytes_per_step"]
            hosts.add(answer["host"])
        else:
            empty.append(delay)
    size = full[0][1]
    seconds = max(1e-9, median(delay for delay, _ in full) - median(empty))
    return Traffic(bytes_per_step=bytes_per_step, bytes_per_second=size / seconds, hosts=tuple(sorted(hosts)))


def return_batch(config: Mapping[str, Any], folder: Path, size: int, report: Report) -> dict[str, Any]:
    """Collect a batch of about ``size`` bytes, and return it as soon as no other job is returning a batch."""
    batch, bytes_per_step = collect(RunConfig(**config)) if size else ([], 0.0)
    total = sum(array.nbytes for array in batch)
    batch = [np.concatenate([array] * max(1, size // total)) for array in batch]
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            os.mkdir(_lock(folder))
            break
        except FileExistsError:
            if time.monotonic() > end:
                raise TimeoutError("timed out while waiting for another job to return its batch.") from None
            time.sleep(0.001)
    return {"batch": batch, "bytes_per_step": bytes_per_step, "host": node()[0], "finished": time.time()}


def collect(config: RunConfig) -> tuple[list[np.ndarray[Any, Any]], float]:
    """Step environments with random actions.

    Returns:
        The arrays of observations, actions, rewards and end-of-episode flags, and their size per environment step [B].
    """
    from frobs_train import make_training_env

    with closing(make_training_env(config)) as env:
        env.action_space.seed(0)
        env.reset(seed=0)
        steps = []
        for _ in range(_STEPS):
            action = env.action_space.sample()
            observation, reward, terminated, truncated, _ = env.step(action)
            steps.append([*_arrays(observation), *_arrays(action), reward.astype(np.float32), terminated, truncated])
    batch = [np.concatenate([np.array(array) for array in arrays]) for arrays in zip(*steps, strict=True)]
    return batch, sum(array.nbytes for array in batch) / (_STEPS * config.num_envs)


def _arrays(value: Any) -> Iterator[np.ndarray[Any, Any]]:
    """Yield the array of an observation or action, or all arrays in a mapping or tuple."""
    if isinstance(value, Mapping):
        for item in value.values():
            yield from _arrays(item)
    elif isinstance(value, tuple):
        for item in value:
            yield from _arrays(item)
    else:
        yield np.array(value)


def _lock(folder: Path) -> Path:
    return folder / "returning"
