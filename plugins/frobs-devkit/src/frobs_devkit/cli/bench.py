"""``frobs bench``: measures the time of steps, training runs and pictures, and how speed scales with parallelism."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frobs_cli.errors import CommandLineError
from frobs_cli.facts import print_facts
from frobs_cli.field_options import option
from frobs_cli.formats import duration
from frobs_cli.model_options import ROBOT_FLAGS, RobotChoice
from frobs_cli.options import Controller, EnvId, Json, Simulator
from frobs_cli.output import only_json, print_json, working
from frobs_devkit.cli.bench_scaling import read_sizes, report_scaling
from frobs_train.cli.runner_options import RayAddress, RunnerName

if TYPE_CHECKING:
    from frobs_devkit.bench import BenchResult
    from frobs_devkit.bench_training import TrainingBenchResult
    from frobs_train import RunConfig


_UP_TO_ALL = "1, 2, 4, … up to the number of processors"
_ONLY_SCALING = ("threads", "processes", "jobs", "seconds", "ray_address", "out")


@dataclass(frozen=True, kw_only=True)
class BenchOptions(RobotChoice):
    """Options of ``frobs bench``.

    Attributes:
        training: Measure a training run instead of a step, and suggest settings.
        cameras: Measure how long it takes to render the pictures of the environment's cameras.
        scaling: Measure how speed and memory scale with environments, threads, processes and nodes.
        algorithm: Algorithm for --training: a name from 'frobs list algorithms'.
        num_envs: Number of environments to step as one batch; with --cameras or --scaling, a list of numbers to
            measure; with --training, also the number on each of several simulators, as for 'frobs train'.
        steps: Number of steps to measure after the warm-up; with --training, number of environment steps, summed over
            all environments.
        threads: With --scaling: numbers of simulator threads with which the speed is measured.
        processes: With --scaling: numbers of processes with which the speed of this machine is measured.
        jobs: With --scaling --runner ray: numbers of processes to measure on the cluster, each on one processor.
        seconds: With --scaling: duration of each measurement, in seconds.
        out: With --scaling: PNG file for the plot.
        settings: Training setting for --training or --scaling, in the same form as for 'frobs train'. Repeatable.
    """

    training: bool = option(False)
    cameras: bool = option(False)
    scaling: bool = option(False)
    algorithm: str | None = option(None, show_default="that of the ID")
    num_envs: str | None = option(
        None,
        metavar="N",
        show_default="1; with --training, the configured number; with --cameras, 1,8,64; with --scaling, 1,8,64,512",
    )
    steps: int | None = option(None, min=10, show_default="1000; with --training, about 4 seconds")
    threads: str | None = option(None, metavar="N,N…", show_default=_UP_TO_ALL)
    processes: str | None = option(None, metavar="N,N…", show_default=_UP_TO_ALL)
    jobs: str | None = option(None, metavar="N,N…", show_default="1,2")
    runner: RunnerName = "local"
    ray_address: RayAddress = None
    seconds: float | None = option(None, metavar="S", min=0.1, show_default="2")
    out: Path | None = option(None, dir_okay=False, show_default="no plot")
    simulator: Simulator = None
    controller: Controller = None
    settings: Sequence[str] = option((), name="set", metavar="KEY=VALUE")

    @property
    def uses_cluster(self) -> bool:
        """Whether processes on a cluster are measured."""
        return self.runner != "local" or self.ray_address is not None

    def reject(self, names: Iterable[str], reason: str) -> None:
        """Raise CommandLineError if one of the options is given."""
        for name in names:
            if getattr(self, name) not in (None, False, [], (), "local"):
                flag = "set" if name == "settings" else name.replace("_", "-")
                raise CommandLineError(f"--{flag}", reason)

    def flags(self, **flags: Any) -> dict[str, Any]:
        """Return the flags of :func:`frobs_train.resolve_config`, with additional ones."""
        return flags | {name: getattr(self, name) for name in (*ROBOT_FLAGS, "simulator", "controller")}


def bench(
    env_id: EnvId,
    options: BenchOptions,
    json: Json = False,
) -> None:
    """Measure how long each part of a step, a training run or a picture takes, or how speed scales with parallelism.

    By default, an environment step is compared with a step of the bare engine, which replays the same states and
    controls. The environment and the bare engine alternate every few steps. With --training, a short in-memory training
    run is measured with the settings that 'frobs train' would use. The command also measures alternatives to some
    settings, and suggests the alternatives that are clearly faster.

    With --cameras, the command measures the pictures per second of all cameras for several sizes and numbers of
    environments.

    With --scaling, the command measures how the steps per second and the memory use depend on the number of
    environments, simulator threads and processes. With --runner ray, the command also varies the number of processes on
    a cluster. Each measurement runs in new processes.

    Example:
        $ frobs bench frobs/Irb120Reach-v0
        $ frobs bench frobs/Irb120Reach-v0 --num-envs 1024 --steps 100
        $ frobs bench frobs/Reach-v0 --robot arm.urdf --tcp tool0 --package-path ~/ros/src
        $ frobs bench frobs/Irb120Reach-v0 --training --algorithm sac
        $ frobs bench frobs/PandaPickAndPlace-v0 --cameras
        $ frobs bench frobs/Irb120Reach-v0 --scaling --out scaling.png
        $ frobs bench frobs/Irb120Reach-v0 --scaling --runner ray --ray-address auto --jobs 1,8,16
    """
    from frobs_core.plugins.registry import find_spec

    find_spec(env_id)
    if options.training or options.scaling:
        mode = "--scaling" if options.scaling else "--training"
        options.reject(("args", "package_path"), f"use --set environment_kwargs.… with {mode}.")
    if options.scaling:
        options.reject(["training", "cameras"], "choose one of --training, --cameras and --scaling.")
        options.reject(["algorithm"], "this option requires --training.")
        options.reject(["steps"], "--scaling measures for a given time; use --seconds.")
        with only_json(json):
            config = _resolve(env_id, options.flags(), options.settings, trains=False)
        report_scaling(config, options, json=json)
        return
    options.reject((*_ONLY_SCALING, "runner"), "this option requires --scaling.")
    if options.cameras:
        _bench_cameras(env_id, options, json=json)
        return
    if options.training:
        from frobs_devkit.bench_training import bench_training

        flags = options.flags(algorithm=options.algorithm, num_envs=options.num_envs)
        with only_json(json), working("measuring a training run"):
            trained = bench_training(_resolve(env_id, flags, options.settings), steps=options.steps)
        print_json(trained) if json else print_facts(_training_facts(trained))
        return
    options.reject(["algorithm"], "this option requires --training.")
    options.reject(["settings"], "this option requires --training or --scaling.")
    from frobs_devkit.bench import bench as measure

    count, steps = _one_size(options.num_envs), options.steps or 1000
    with only_json(json), working(f"measuring {steps:,} steps"):
        result = measure(env_id, num_envs=count or 1, steps=steps, **_keywords(options))
    print_json(result) if json else print_facts(_step_facts(result))


def _keywords(options: BenchOptions) -> dict[str, Any]:
    parts = {"simulator": options.simulator, "controller": options.controller}
    return options.keywords() | {key: value for key, value in parts.items() if value is not None}


def _bench_cameras(env_id: str, options: BenchOptions, *, json: bool) -> None:
    from frobs_devkit.bench_cameras import NUM_ENVS, bench_cameras

    options.reject(["training"], "choose one of --training, --cameras and --scaling.")
    options.reject(["algorithm", "settings"], "this option requires --training.")
    options.reject(["steps"], "--cameras measures pictures instead of steps.")
    with only_json(json), working("drawing pictures"):
        found = bench_cameras(
            env_id, num_envs=read_sizes("--num-envs", options.num_envs) or NUM_ENVS, **_keywords(options)
        )
    if json:
        print_json(found)
        return
    rows = [
        {
            "environments": each.num_envs,
            "pixels": f"{each.size} × {each.size}",
            "time_of_a_picture": _time(each.seconds),
            "pictures_per_second": f"{1.0 / each.seconds:,.0f}",
        }
        for each in found.speeds
    ]
    print_facts(
        {
            "name": found.id,
            "kind": f"pictures of {', '.join(found.cameras)}",
            "machine": found.machine,
            "pictures": rows,
        }
    )


def _one_size(num_envs: str | None) -> int | None:
    sizes = read_sizes("--num-envs", num_envs)
    if sizes is None:
        return None
    if len(sizes) > 1:
        raise CommandLineError(
            "--num-envs", "a list of numbers requires --scaling; add --scaling, or specify a single number."
        )
    return sizes[0]


def _resolve(env_id: str, flags: dict[str, Any], settings: Sequence[str], *, trains: bool = True) -> RunConfig:
    from frobs_train import resolve_config

    return resolve_config(env_id, flags=flags, settings=settings, check_parts=True, trains=trains)


def _step_facts(found: BenchResult) -> dict[str, Any]:
    return {
        "name": found.id,
        "kind": _environments(found.num_envs),
        "step": f"{_time(found.step_seconds)}, of {found.decimation} physics steps; median of {found.steps:,}",
        "steps_per_second": f"{found.steps_per_second:,.0f}",
        "bare_engine": "not available in this simulator" if found.bare_seconds is None else _time(found.bare_seconds),
        "ratio": None if found.ratio is None else f"{found.ratio:.2f}",
        "machine": found.machine,
        "parts": [
            {"part": part, "time": _time(seconds), "share": f"{100.0 * seconds / found.step_seconds:.0f} %"}
            for part, seconds in found.parts.items()
        ],
    }


def _training_facts(found: TrainingBenchResult) -> dict[str, Any]:
    return {
        "name": found.id,
        "kind": f"training run with {found.algorithm}, {_environments(found.num_envs)}",
        "measured": f"{found.steps:,} environment steps after the warm-up",
        "steps_per_second": f"{found.steps_per_second:,.0f}",
        "checkpoint": f"{_time(found.checkpoint_seconds)} each, {found.checkpoints} in the training run",
        "estimated_time": f"{duration(found.total_seconds)} for {found.total_steps:,} environment steps",
        "machine": found.machine,
        "parts": [
            {"part": part, "per_1,000_steps": _time(seconds), "share": f"{100.0 * found.shares[part]:.1f} %"}
            for part, seconds in found.parts.items()
        ],
        "suggestions": [{"setting": key, "suggestion": text} for key, text in found.suggestions.items()],
    }


def _environments(number: int) -> str:
    return "1 environment" if number == 1 else f"{number:,} environments"


def _time(seconds: float) -> str:
    """Return ``"83.1 µs"``, ``"12.4 ms"`` or ``"3.69 s"``."""
    if seconds < 1e-3:
        return f"{1e6 * seconds:.1f} µs"
    return f"{1e3 * seconds:.2f} ms" if seconds < 1.0 else f"{seconds:.2f} s"
