"""Measures how long it takes to render the pictures of an environment's cameras."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Any

from frobs_core.util.errors import ConfigurationError
from frobs_core.util.validation import whole_number
from frobs_devkit.timing import machine
from frobs_train import make_vector_env

NUM_ENVS, SIZES = (1, 8, 64), (64, 128, 256)
_STEPS = 10  # before the pictures, so that the environments differ
_REPETITIONS = 5


@dataclass(frozen=True)
class CameraSpeed:
    """Speed of the cameras of a vector environment."""

    num_envs: int  # number of environments that are drawn by one call
    size: int  # height and width of the pictures [pixels]
    seconds: float  # median time of a picture [s]


@dataclass(frozen=True)
class CameraBenchResult:
    """Result of :func:`bench_cameras`."""

    id: str  # the environment's ID
    cameras: tuple[str, ...]  # names of the cameras, which all draw as many pictures
    speeds: tuple[CameraSpeed, ...]  # for each number of environments and each size
    machine: str  # processor, operating system and Python


def bench_cameras(
    id: str, *, num_envs: Sequence[int] = NUM_ENVS, sizes: Sequence[int] = SIZES, **keywords: Any
) -> CameraBenchResult:
    """Measure how long a picture for an observation takes, for several numbers of environments and sizes [pixels].

    Raises ConfigurationError if the environment has no camera, or a number is too small.
    """
    for name, values in (("num_envs", num_envs), ("sizes", sizes)):
        for value in values:
            whole_number(name, value, lowest=1)
    speeds: list[CameraSpeed] = []
    cameras: tuple[str, ...] = ()
    for count in num_envs:
        with closing(_moved(id, count, keywords)) as env:
            simulation = env.unwrapped.simulation
            cameras = tuple(simulation.scene.cameras)
            if not cameras:
                raise ConfigurationError(f"{id} has no camera; add one with the keyword 'cameras'.")
            speeds += [CameraSpeed(count, size, _seconds(simulation, cameras, size)) for size in sizes]
    return CameraBenchResult(id, cameras, tuple(speeds), machine())


def _moved(id: str, num_envs: int, keywords: Mapping[str, Any]) -> Any:
    env: Any = make_vector_env(id, num_envs, dict(keywords))
    if not hasattr(env.unwrapped, "simulation"):
        env.close()
        raise ConfigurationError(
            f"'{id}' is not a FRobs environment; only cameras of FRobs environments can be measured."
        )
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(_STEPS):
        env.step(env.action_space.sample())
    return env


def _seconds(simulation: Any, cameras: Sequence[str], size: int) -> float:
    """Return the median time of a picture [s]."""
    times: list[float] = []
    for _ in range(1 + _REPETITIONS):
        start = perf_counter()
        for name in cameras:
            simulation.render(None, name, (size, size), fast=True)
        times.append(perf_counter() - start)
    drawn: int = len(cameras) * simulation.num_envs
    return median(times[1:]) / drawn  # the first call creates what OpenGL needs
