"""The report of ``frobs bench --scaling``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from frobs_cli.errors import CommandLineError
from frobs_cli.facts import print_facts
from frobs_cli.formats import percent
from frobs_cli.output import console, only_json, print_json, print_note, working

if TYPE_CHECKING:
    from frobs_devkit.cli.bench import BenchOptions
    from frobs_devkit.scaling import ScalingPoint, ScalingResult
    from frobs_train import RunConfig


def report_scaling(config: RunConfig, options: BenchOptions, *, json: bool) -> None:
    """Measure how speed scales with parallelism, print the measurements, and write the plot."""
    from frobs_devkit.scaling import ScalingRanges, bench_scaling, plot_scaling
    from frobs_train.cli.runner_options import RunnerChoice

    out = options.out
    if out is not None and out.suffix.lower() != ".png":
        raise CommandLineError("--out", f"'{out}' is not a PNG file; use a name such as scaling.png.")
    cluster = None
    if options.uses_cluster:
        cluster = RunnerChoice(runner=options.runner, ray_address=options.ray_address).open()
    if cluster is None and options.jobs is not None:
        raise CommandLineError("--jobs", "this option requires a cluster; add --runner ray.")
    ranges = ScalingRanges.choose(
        config,
        num_envs=read_sizes("--num-envs", options.num_envs),
        threads=read_sizes("--threads", options.threads),
        processes=read_sizes("--processes", options.processes),
        cluster_processes=None if cluster is None else read_sizes("--jobs", options.jobs) or (1, 2),
        seconds=options.seconds,
    )
    with only_json(json), _progress() as on_step:
        result = bench_scaling(config, ranges, runner=cluster, on_step=on_step)
    if out is not None:
        plot_scaling([result], out)
    if json:
        print_json({**result.to_dict(), "picture": out})
        return
    print_facts(scaling_facts(result))
    if result.is_disturbed:
        print_note(
            "Other programs were using the processors, so the measured speed is too low. Close them and measure again."
        )
    if out is not None:
        print_note(f"The plot was written to {out}.")


def read_sizes(option: str, text: str | None) -> tuple[int, ...] | None:
    """Return the numbers in a list such as ``"1,8,64"`` in ascending order, or None if the option was not given."""
    if text is None:
        return None
    try:
        sizes = sorted({int(part) for part in text.split(",")})
    except ValueError:
        sizes = []
    if not sizes or sizes[0] < 1:
        raise CommandLineError(option, f"'{text}' is not a list of positive whole numbers, such as 1,8,64.")
    return tuple(sizes)


def scaling_facts(result: ScalingResult) -> dict[str, Any]:
    """Return the measurements as a dictionary for printing."""
    per_env = None if result.memory_per_env is None else f" + {result.memory_per_env / 1e3:,.1f} kB per environment"
    return {
        "name": result.id,
        "kind": "scaling",
        "memory": f"{result.memory_per_process / 1e6:,.0f} MB per process{per_env or ''}",
        "start-up": f"{result.startup:.1f} s",
        "machine": result.machine,
        "load": f"on average, {result.load:.1f} processes were running or waiting for a processor before the "
        "measurement",
        "measured": [_row(point) for point in result.points],
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


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Report the progress on stderr: on a single line in a terminal, otherwise on one line per measurement."""
    if not console(stderr=True).is_terminal:
        yield lambda text: print_note(f"measuring {text}")
        return
    with working("measuring") as show:
        yield lambda text: show(f"measuring {text}")
