"""Options of commands that use a runner."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from frobs_train.runners.runner import Runner

RunnerName = Annotated[
    str,
    typer.Option(
        "--runner",
        metavar="NAME",
        help="Where to run the jobs. local: one after another in this process; ray: in parallel on a Ray cluster "
        "(requires the frobs-ray plugin).",
    ),
]

RayAddress = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        show_default="the environment variable RAY_ADDRESS, or else a new cluster on this machine",
        help="With --runner ray: address of the Ray cluster to join, such as 10.0.0.1:6379 or auto.",
    ),
]

JobCpus = Annotated[
    int | None,
    typer.Option(
        "--cpus", metavar="N", min=1, show_default="1", help="With --runner ray: number of processors per job."
    ),
]

JobMemory = Annotated[
    float | None,
    typer.Option(
        "--memory",
        metavar="GB",
        min=0.1,
        show_default="estimated from the settings",
        help="With --runner ray: memory to reserve for each job, in GB.",
    ),
]


def open_runner(name: str, address: str | None, cpus: int | None, memory: float | None) -> Runner:
    """Return the runner selected by the command-line options."""
    from frobs_train.runners.runner import RunnerOptions, load_runner

    size = None if memory is None else int(memory * 1e9)
    return load_runner(name, RunnerOptions(address=address, processors=cpus, memory=size))
