"""Benchmarks an environment step: measures the time of each part, and the overhead compared with the bare engine.

The bare engine *replays* the environment's steps: before each step, it loads the recorded state and controls. If the
environment reads lidars, the bare engine casts the same rays. The environment and the bare engine alternate every few
steps. Changes in the machine's speed therefore affect both measurements, and the processor caches stay warm during
consecutive steps, as in a training loop. The reported times are medians.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from math import ceil
from statistics import median
from time import perf_counter
from typing import Any, TypeAlias

from frobs_core.contracts import Snapshot
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.validation import whole_number
from frobs_devkit.timing import Stopwatch, machine
from frobs_train import make_env, make_vector_env

_TURN = 25  # number of environment steps before the bare engine replays them

Rays: TypeAlias = tuple[Floats, Floats, float]
"""Ray origins [m] and directions, each of shape (num_envs, rays, 3), and the maximum range [m]."""

PARTS = ("engine", "controller", "task", "environment", "wrappers")
"""Parts of an environment step."""


@dataclass(frozen=True)
class BenchResult:
    """Result of one benchmark.

    Attributes:
        id: The environment's ID.
        num_envs: Number of environments stepped together.
        decimation: Number of physics steps per environment step.
        steps: Number of measured steps.
        step_seconds: Median time of one ``step`` call [s], including the wrappers that ``gymnasium.make`` adds.
        bare_seconds: Median time that the bare engine takes to replay a step, including the environment's lidar rays
            [s], or None if the simulator does not provide a bare engine.
        ratio: ``step_seconds`` divided by ``bare_seconds``, or None without a bare engine.
        steps_per_second: Environment steps per second, summed over all environments.
        parts: Median time of each part of a step [s], keyed by the names in :data:`PARTS`.
        machine: Processor, operating system and Python.
    """

    id: str
    num_envs: int
    decimation: int
    steps: int
    step_seconds: float
    bare_seconds: float | None
    ratio: float | None
    steps_per_second: float
    parts: dict[str, float]
    machine: str


def bench(id: str, *, num_envs: int = 1, steps: int = 1000, seed: int = 0, **keywords: Any) -> BenchResult:
    """Compare the speed of a FRobs environment with the speed of its simulation engine alone.

    Args:
        id: ID of the environment.
        num_envs: Number of environments. If the number is greater than 1, the function measures a vector environment.
        steps: Minimum number of steps to measure, in addition to a warm-up of 10 % of this number.
        seed: Seed for the environment and the random actions.
        keywords: Keywords of the environment.

    Raises:
        ConfigurationError: The ID does not belong to a FRobs environment, or ``num_envs`` or ``steps`` is too small.
    """
    whole_number("steps", steps, lowest=10)
    whole_number("num_envs", num_envs, lowest=1)
    with closing(_make(id, num_envs, keywords)) as env, closing(_make(id, num_envs, keywords)) as twin:
        return _measure(id, env, twin, num_envs, steps, seed)


def _make(id: str, num_envs: int, keywords: dict[str, Any]) -> Any:
    env: Any = make_env(id, keywords) if num_envs == 1 else make_vector_env(id, num_envs, keywords)
    if not isinstance(env.unwrapped, (RobotEnv, RobotVectorEnv)):
        env.close()
        raise ConfigurationError(
            f"'{id}' is not a FRobs environment; only FRobs environments can be compared with a bare engine."
        )
    return env


def _measure(id: str, env: Any, twin: Any, num_envs: int, steps: int, seed: int) -> BenchResult:
    """Time the steps of ``env``; in ``twin``, time the parts of each step and record the states to replay."""
    inner, shadow = env.unwrapped, twin.unwrapped
    bare = inner.simulation.bare_engine()
    stopwatch, before, cast = _watch(shadow, replayed=bare is not None)
    times: dict[str, list[float]] = {name: [] for name in ("wrapped", "unwrapped", "bare", *PARTS[:3])}
    env.action_space.seed(seed)
    env.reset(seed=seed)
    twin.reset(seed=seed)
    turn = min(_TURN, steps) if num_envs == 1 else 1
    turns, warm_up = ceil(steps / turn), ceil(steps / 10 / turn)
    for k in range(warm_up + turns):
        warm = k >= warm_up
        actions = [env.action_space.sample() for _ in range(turn)]
        ends = []
        for j, action in enumerate(actions):
            wrapped = (k + j) % 2 == 0  # every second step bypasses the wrappers, to measure their cost
            start = perf_counter()
            outcome = (env if wrapped else inner).step(action)
            stepped = perf_counter() - start
            if warm:
                times["wrapped" if wrapped else "unwrapped"].append(stepped)
            ends.append(num_envs == 1 and (outcome[2] or outcome[3]))
            if ends[-1]:
                env.reset()
        states: list[tuple[Snapshot, list[Rays]]] = []
        for action, end in zip(actions, ends, strict=True):
            stopwatch.clear()
            cast.clear()
            shadow.step(action)
            states.append((before.copy(), list(cast.values())))
            if warm:
                for part in PARTS[:3]:
                    times[part].append(stopwatch.seconds(part))
            if end:
                twin.reset()
        for state, rays in states if bare is not None else ():
            bare.load(state)
            start = perf_counter()
            bare.step(inner.decimation)
            for origins, directions, max_range in rays:
                bare.rays(origins, directions, max_range)
            if warm:
                times["bare"].append(perf_counter() - start)
    medians = {name: median(values) for name, values in times.items() if values}
    parts = {name: medians[name] for name in PARTS[:3]}
    parts["environment"] = max(0.0, medians["unwrapped"] - sum(parts.values()))
    parts["wrappers"] = max(0.0, medians["wrapped"] - medians["unwrapped"])
    return BenchResult(
        id=id,
        num_envs=num_envs,
        decimation=inner.decimation,
        steps=turns * turn,
        step_seconds=medians["wrapped"],
        bare_seconds=medians.get("bare"),
        ratio=medians["wrapped"] / medians["bare"] if bare is not None else None,
        steps_per_second=num_envs / medians["wrapped"],
        parts=parts,
        machine=machine(),
    )


def _watch(env: Any, *, replayed: bool) -> tuple[Stopwatch, Snapshot, dict[tuple[str, str], Rays]]:
    """Start timing the parts of a step and recording states and lidar rays.

    Return the stopwatch, the simulation's state before its latest step, and a mapping with the first rays that each
    lidar has cast since the mapping was last cleared. The bare engine does not reset episodes, so it casts each lidar's
    rays only once per step.
    """
    stopwatch = Stopwatch()
    before: Snapshot = {}
    cast: dict[tuple[str, str], Rays] = {}

    stopwatch.watch("engine", env.simulation, "step")
    for controller in env.control.controllers.values():
        stopwatch.watch("controller", controller, "apply")
    for method in ("advance", "reward", "reward_terms", "is_terminated", "is_success"):
        stopwatch.watch("task", env.task, method)
    stopwatch.watch("task", env.observations, "observe")
    step = env.simulation.step

    def saved(*args: Any) -> Any:
        before.update(env.simulation.snapshot())  # not a part of the measured times
        return step(*args)

    if replayed:
        env.simulation.step = saved
    for robot in env.simulation.robots.values() if replayed else ():
        _watch_lidars(robot, cast)
    return stopwatch, before, cast


def _watch_lidars(robot: Any, cast: dict[tuple[str, str], Rays]) -> None:
    original = robot.lidar

    def lidar(name: str) -> Any:
        if (robot.name, name) not in cast:
            what, origins, directions = robot.lidar_rays(name)
            cast[robot.name, name] = origins.copy(), directions.copy(), what.range_max
        return original(name)

    robot.lidar = lidar
