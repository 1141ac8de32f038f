"""``frobs bench``: measures the time of each part of a step or training run, and how speed scales with parallelism."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.facts import print_facts
from frobs_cli.formats import duration
from frobs_cli.model_options import PackagePath, XacroArgs, robot_keywords
from frobs_cli.options import Controller, EnvId, Json, Robot, Simulator, Tcp
from frobs_cli.output import only_json, print_json, working
from frobs_devkit.cli.bench_scaling import (
    Jobs,
    Network,
    NodeProcessors,
    Out,
    Predict,
    Price,
    Processes,
    Scaling,
    Seconds,
    Threads,
    read_sizes,
    report_scaling,
)
from frobs_train.cli.runner_options import RayAddress, RunnerName

if TYPE_CHECKING:
    from frobs_devkit.bench import BenchResult
    from frobs_devkit.bench_training import TrainingBenchResult
    from frobs_train import RunConfig


def bench(
    env_id: EnvId,
    training: Annotated[
        bool, typer.Option("--training", help="Measure a training run instead of a step, and suggest settings.")
    ] = False,
    scaling: Scaling = False,
    algorithm: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default="ppo",
            help="Algorithm for --training and --predict: a name from 'frobs list algorithms'.",
        ),
    ] = None,
    num_envs: Annotated[
        str | None,
        typer.Option(
            metavar="N",
            show_default="1; with --training, the configured number; with --scaling, 1,8,64,512",
            help="Number of environments to step as one batch; with --scaling, a list of numbers to measure.",
        ),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=10,
            show_default="1000; with --training, about 4 seconds; with --predict, the configured number",
            help="Number of steps to measure after the warm-up; with --training, number of environment steps, summed "
            "over all environments; with --predict, number of environment steps in the training run.",
        ),
    ] = None,
    threads: Threads = None,
    processes: Processes = None,
    jobs: Jobs = None,
    runner: RunnerName = "local",
    ray_address: RayAddress = None,
    seconds: Seconds = None,
    predict: Predict = None,
    node_processors: NodeProcessors = None,
    network: Network = None,
    price: Price = None,
    out: Out = None,
    robot: Robot = None,
    tcp: Tcp = None,
    args: XacroArgs = None,
    package_path: PackagePath = None,
    simulator: Simulator = None,
    controller: Controller = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            show_default=False,
            help="Training setting for --training or --scaling, in the same form as for 'frobs train'. Repeatable.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Measure how long each part of a step or training run takes, or how speed scales with parallelism.

    By default, an environment step is compared with a step of the bare engine, which replays the same states and
    controls. The environment and the bare engine alternate every few steps. With --training, a short in-memory training
    run is measured with the settings that 'frobs train' would use. The command also measures alternatives to some
    settings, and suggests the alternatives that are clearly faster.

    With --scaling, the command measures how the steps per second and the memory use depend on the number of
    environments, simulator threads and processes. With --runner ray, the command also varies the number of processes on
    a cluster. Each measurement runs in new processes. With --predict, the command fits a model to the measurements and
    predicts the time of a training run on more nodes.

    Example:
        $ frobs bench frobs/Irb120Reach-v0
        $ frobs bench frobs/Irb120Reach-v0 --num-envs 1024 --steps 100
        $ frobs bench frobs/Reach-v0 --robot arm.urdf --tcp tool0 --package-path ~/ros/src
        $ frobs bench frobs/Irb120Reach-v0 --training --algorithm sac
        $ frobs bench frobs/Irb120Reach-v0 --scaling --out scaling.png
        $ frobs bench frobs/Irb120Reach-v0 --scaling --runner ray --ray-address auto --jobs 1,8,16 --predict 10,100,1000
    """
    from frobs_core.plugins.registry import find_spec

    find_spec(env_id)
    keywords: dict[str, Any] = {"simulator": simulator, "controller": controller}
    ranges: dict[str, Any] = {
        "threads": threads,
        "processes": processes,
        "jobs": jobs,
        "seconds": seconds,
        "ray_address": ray_address,
    }
    prediction: dict[str, Any] = {
        "predict": predict,
        "node_processors": node_processors,
        "network": network,
        "price": price,
        "out": out,
    }
    if training or scaling:
        mode = "--scaling" if scaling else "--training"
        _reject({"--args": args, "--package-path": package_path}, f"use --set environment_kwargs.… with {mode}.")
    if scaling:
        _reject({"--training": training}, "choose either --training or --scaling.")
        if steps is not None and predict is None:
            raise CommandLineError(
                "--steps",
                "this option requires --predict if --scaling is used; add, for example, --predict 10,100,1000.",
            )
        flags = {"algorithm": algorithm, "robot": robot, "tcp": tcp, "steps": steps, **keywords}
        with only_json(json):
            config = _resolve(env_id, flags, settings)
        report_scaling(config, num_envs=num_envs, runner=runner, json=json, **ranges, **prediction)
        return
    only_scaling = {f"--{name.replace('_', '-')}": value for name, value in (ranges | prediction).items()}
    only_scaling["--runner"] = None if runner == "local" else runner
    _reject(only_scaling, "this option requires --scaling.")
    count = _one_size(num_envs)
    if training:
        flags = {"algorithm": algorithm, "num_envs": count, "robot": robot, "tcp": tcp, **keywords}
        with only_json(json), working("measuring a training run"):
            trained = _measure_training(_resolve(env_id, flags, settings), steps)
        print_json(trained) if json else print_facts(_training_facts(trained))
        return
    _reject({"--algorithm": algorithm, "--set": settings}, "this option requires --training or --scaling.")
    from frobs_devkit.bench import bench as measure

    options = robot_keywords(robot, tcp, args, package_path)
    options |= {key: value for key, value in keywords.items() if value is not None}
    steps = steps or 1000
    with only_json(json), working(f"measuring {steps:,} steps"):
        result = measure(env_id, num_envs=count or 1, steps=steps, **options)
    print_json(result) if json else print_facts(_step_facts(result))


def _reject(options: dict[str, object], reason: str) -> None:
    for name, value in options.items():
        if value not in (None, False, [], ()):
            raise CommandLineError(name, reason)


def _one_size(num_envs: str | None) -> int | None:
    sizes = read_sizes("--num-envs", num_envs)
    if sizes is None:
        return None
    if len(sizes) > 1:
        raise CommandLineError(
            "--num-envs", "a list of numbers requires --scaling; add --scaling, or specify a single number."
        )
    return sizes[0]


def _resolve(env_id: str, flags: dict[str, Any], settings: Sequence[str] | None) -> RunConfig:
    from frobs_train import resolve_config

    return resolve_config(env_id, flags=flags, settings=settings or (), check_parts=True)


def _measure_training(config: RunConfig, steps: int | None) -> TrainingBenchResult:
    from frobs_devkit.bench_training import bench_training

    return bench_training(config, steps=steps)


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
