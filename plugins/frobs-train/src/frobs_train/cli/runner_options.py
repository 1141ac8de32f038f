"""Options of commands that use a runner."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.field_options import option

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


@dataclass(frozen=True, kw_only=True)
class RunnerChoice:
    """A runner, as chosen on the command line.

    Attributes:
        cpus: With --runner ray: number of processors per job.
        memory: With --runner ray: memory to reserve for each job, in GB.
    """

    runner: RunnerName = "local"
    ray_address: RayAddress = None
    cpus: int | None = option(None, min=1, show_default="1")
    memory: float | None = option(None, metavar="GB", min=0.1, show_default="estimated from the settings")

    @property
    def is_local(self) -> bool:
        """Whether the jobs run one after another in this process."""
        from frobs_train.runners.runner import LOCAL

        return self.runner == LOCAL

    def open(self) -> Runner:
        """Return the runner.

        Raises:
            CommandLineError: The memory is not finite.
        """
        from frobs_train.runners.runner import RunnerOptions, load_runner

        if self.memory is not None and not math.isfinite(self.memory):
            raise CommandLineError("--memory", f"{self.memory} is not a number of GB.")
        size = None if self.memory is None else int(self.memory * 1e9)
        return load_runner(self.runner, RunnerOptions(address=self.ray_address, processors=self.cpus, memory=size))
