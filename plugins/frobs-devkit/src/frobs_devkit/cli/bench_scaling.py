"""The options and the report of ``frobs bench --scaling``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.facts import print_facts
from frobs_cli.formats import duration, percent
from frobs_cli.output import console, only_json, print_json, print_line, print_note, working

if TYPE_CHECKING:
    from frobs_devkit.scaling import Prediction, ScalingModel, ScalingPoint, ScalingResult
    from frobs_train import RunConfig

_GIGABIT = 1e9 / 8  # [B/s]

Scaling = Annotated[
    bool,
    typer.Option(
        "--scaling",
        help="Measure how speed and memory scale with environments, threads, processes and nodes.",
    ),
]

Threads = Annotated[
    str | None,
    typer.Option(
        metavar="N,N…",
        show_default="1, 2, 4, … up to the number of processors",
        help="With --scaling: numbers of simulator threads with which the speed is measured.",
    ),
]

Processes = Annotated[
    str | None,
    typer.Option(
        metavar="N,N…",
        show_default="1, 2, 4, … up to the number of processors",
        help="With --scaling: numbers of processes with which the speed of this machine is measured.",
    ),
]

Jobs = Annotated[
    str | None,
    typer.Option(
        metavar="N,N…",
        show_default="1,2",
        help="With --scaling --runner ray: numbers of processes to measure on the cluster, each on one processor.",
    ),
]

Seconds = Annotated[
    float | None,
    typer.Option(
        metavar="S", min=0.1, show_default="2", help="With --scaling: duration of each measurement, in seconds."
    ),
]

Predict = Annotated[
    str | None,
    typer.Option(
        metavar="N,N…",
        show_default=False,
        help="With --scaling: numbers of nodes for which to predict the speed and duration of a training run with "
        "--steps steps.",
    ),
]

NodeProcessors = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        show_default="those of this machine",
        help="With --predict: number of processors per node.",
    ),
]

Network = Annotated[
    float | None,
    typer.Option(
        metavar="GBIT",
        min=1e-6,
        show_default="the measured bandwidth if the cluster has several machines, otherwise unlimited",
        help="With --predict: network bandwidth of the learner's machine, in Gbit/s.",
    ),
]

Price = Annotated[
    float | None,
    typer.Option(
        metavar="PRICE",
        min=0.0,
        show_default="report node-hours only",
        help="With --predict: price of one node per hour, in your currency.",
    ),
]

Out = Annotated[
    Path | None,
    typer.Option(metavar="FILE", dir_okay=False, show_default="no plot", help="With --scaling: PNG file for the plot."),
]


def report_scaling(
    config: RunConfig,
    *,
    num_envs: str | None,
    threads: str | None,
    processes: str | None,
    jobs: str | None,
    seconds: float | None,
    runner: str,
    ray_address: str | None,
    predict: str | None,
    node_processors: int | None,
    network: float | None,
    price: float | None,
    out: Path | None,
    json: bool,
) -> None:
    """Measure how speed scales with parallelism, print the measurements and predictions, and write the plot."""
    from frobs_devkit.scaling import ScalingRanges, bench_scaling, fit_model, plot_scaling
    from frobs_train import LOCAL, usable_processors
    from frobs_train.cli.runner_options import open_runner

    nodes = read_sizes("--predict", predict)
    if nodes is None:
        values = {"--node-processors": node_processors, "--network": network, "--price": price}
        for name, value in values.items():
            if value is not None:
                raise CommandLineError(name, "this option requires --predict; add, for example, --predict 10,100,1000.")
    if out is not None and out.suffix.lower() != ".png":
        raise CommandLineError("--out", f"'{out}' is not a PNG file; use a name such as scaling.png.")
    cluster = None if runner == LOCAL and ray_address is None else open_runner(runner, ray_address, None, None)
    if cluster is None and jobs is not None:
        raise CommandLineError("--jobs", "this option requires a cluster; add --runner ray.")
    ranges = ScalingRanges.choose(
        config,
        num_envs=read_sizes("--num-envs", num_envs),
        threads=read_sizes("--threads", threads),
        processes=read_sizes("--processes", processes),
        cluster_processes=() if cluster is None else read_sizes("--jobs", jobs) or (1, 2),
        seconds=seconds or 2.0,
    )
    with only_json(json), _progress() as on_step:
        results = bench_scaling(config, ranges, runner=cluster, learner=nodes is not None, on_step=on_step)
    model = fit_model(results, bandwidth=None if network is None else network * _GIGABIT)
    each = node_processors or usable_processors()
    predictions = [model.predict(count, each, config.steps, price) for count in nodes or ()]
    if out is not None:
        plot_scaling([(results, model, each)], out)
    if json:
        print_json(
            {
                **results.to_dict(),
                "model": asdict(model),
                "steps": config.steps if nodes else None,
                "predictions": [asdict(prediction) for prediction in predictions],
            }
        )
        return
    print_facts(scaling_facts(results, model))
    if results.is_disturbed:
        print_note(
            "Other programs were using the processors, so the measured speed is too low. Close them and measure again."
        )
    if predictions:
        print_line()
        print_facts(prediction_facts(model, predictions, config.steps, each))
    if out is not None:
        print_note(f"The plot was written to {out}.")


def read_sizes(option: str, text: str | None) -> tuple[int, ...] | None:
    """Return the numbers in a list such as ``"1,8,64"`` in ascending order, or None if the option was not given.

    Raises:
        CommandLineError: The text is not a list of positive integers.
    """
    if text is None:
        return None
    try:
        sizes = sorted({int(part) for part in text.split(",")})
    except ValueError:
        sizes = []
    if not sizes or sizes[0] < 1:
        raise CommandLineError(option, f"'{text}' is not a list of positive whole numbers, such as 1,8,64.")
    return tuple(sizes)


def scaling_facts(found: ScalingResult, model: ScalingModel) -> dict[str, Any]:
    """Return the measurements as a dictionary for printing."""
    per_env = None if found.memory_per_env is None else f" + {found.memory_per_env / 1e3:,.1f} kB per environment"
    traffic = found.traffic
    return {
        "name": found.id,
        "kind": "scaling",
        "memory": f"{found.memory_per_process / 1e6:,.0f} MB per process{per_env or ''}",
        "start-up": f"{model.startup:.1f} s",
        "experience": None
        if traffic is None
        else f"{traffic.bytes_per_step:,.0f} bytes per environment step; a learner can receive "
        f"{traffic.bytes_per_second / 1e6:,.0f} MB/s = {traffic.steps_per_second:,.0f} steps/s",
        "machine": found.machine,
        "load": f"on average, {found.load:.1f} processes were running or waiting for a processor before the "
        "measurement",
        "measured": [_row(point) for point in found.points],
    }


def prediction_facts(
    model: ScalingModel, predictions: Sequence[Prediction], steps: int, processors: int
) -> dict[str, Any]:
    """Return the predictions as a dictionary for printing."""
    learner = model.learner
    return {
        "name": "prediction",
        "kind": f"{steps:,} environment steps on nodes with {processors} processors each",
        "model": "n · p · s / ((1 + α (p − 1)) (1 + β (n − 1))), limited by the rate that one learner can handle",
        "parameters": f"s = {model.process_rate:,.0f} steps/s, α = {model.process_contention:.3f}, "
        f"β = {model.node_contention:.3f} ({'measured' if model.node_contention_measured else 'assumed'})",
        "correction": "rates are divided by the share of processor time that the measurement received, because other "
        "programs were running"
        if model.corrected
        else None,
        "learner": None if learner is None else f"{1.0 / learner.learning:,.0f} steps/s with {learner.algorithm}",
        "network": "not limited" if model.bandwidth is None else f"{model.bandwidth / 1e6:,.0f} MB/s",
        "error": _errors(model),
        "nodes": [_predicted(prediction) for prediction in predictions],
    }


def _row(point: ScalingPoint) -> dict[str, Any]:
    return {
        "varied": point.sweep,
        "environments": f"{point.num_envs:,}",
        "threads": point.threads,
        "processes": point.processes,
        "nodes": point.nodes,
        "steps/s": f"{point.steps_per_second:,.0f}",
        "slowest to fastest window": f"{point.low:,.0f} to {point.high:,.0f}",
        "processor_time": percent(point.processor_share, 0),
        "memory_per_process": f"{point.memory / 1e6:,.0f} MB",
    }


def _predicted(prediction: Prediction) -> dict[str, Any]:
    rate, seconds, hours = prediction.steps_per_second, prediction.seconds, prediction.node_hours
    runs = prediction.runs_per_hour
    return {
        "nodes": f"{prediction.nodes:,}",
        "processes": f"{prediction.processes:,}",
        "collected steps/s": f"{prediction.collected:,.0f}",
        "one run, steps/s": None if rate is None else f"{rate:,.0f}",
        "limited by": prediction.limit,
        "time": None if seconds is None else duration(seconds),
        "node-hours": None if hours is None else f"{hours:,.3g}",
        "cost": None if prediction.cost is None else f"{prediction.cost:,.2f}",
        "independent runs per hour": None if runs is None else f"{runs:,.0f}",
    }


def _errors(model: ScalingModel) -> str:
    errors: Mapping[str, float | None] = {
        "most processes": model.process_error,
        "most nodes": model.cluster_error,
    }
    shown = [
        f"{'+' if error > 0 else '−'}{percent(abs(error), 0)} with the {name}"
        for name, error in errors.items()
        if error is not None
    ]
    return (
        "; ".join(shown) + ", each predicted by a fit that excludes this measurement"
        if shown
        else "unknown; to estimate the error, measure at least two numbers of processes or nodes"
    )


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Report the progress on stderr: on a single line in a terminal, otherwise on one line per measurement."""
    if not console(stderr=True).is_terminal:
        yield lambda text: print_note(f"measuring {text}")
        return
    with working("measuring") as show:
        yield lambda text: show(f"measuring {text}")
