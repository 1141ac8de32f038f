"""Numbers of environments, threads and processes for which the scaling is measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

from frobs_core.util.validation import positive, whole_number
from frobs_train import RunConfig, decide_threads, is_paced, usable_processors

_NUM_ENVS = (1, 8, 64, 512)


@dataclass(frozen=True, kw_only=True)
class ScalingRanges:
    """Sizes to measure. Empty ranges are skipped.

    Attributes:
        num_envs: Numbers of environments to measure in one process with one thread.
        threads: Numbers of simulator threads to measure in one process.
        processes: Numbers of processes to measure on this machine, each with one thread.
        cluster_processes: Numbers of processes to measure on a cluster, each with one thread.
        seconds: Measurement time per size [s]. Starting the processes takes a few additional seconds.
    """

    num_envs: tuple[int, ...] = _NUM_ENVS
    threads: tuple[int, ...] = ()
    processes: tuple[int, ...] = ()
    cluster_processes: tuple[int, ...] = ()
    seconds: float = 2.0

    def __post_init__(self) -> None:
        """Raise ConfigurationError if a number is out of range or ``num_envs`` is empty."""
        for name in ("num_envs", "threads", "processes", "cluster_processes"):
            for value in getattr(self, name):
                whole_number(name, value, lowest=1)
        positive("seconds", self.seconds, "s")
        whole_number("the number of sizes in num_envs", len(self.num_envs), lowest=1)

    @classmethod
    def choose(cls, config: RunConfig, **ranges: Any) -> Self:
        """Return the ranges. A range that is None or omitted is replaced with one that suits the environment.

        A simulator that is paced by the wall clock only supports a single environment. Environments of other libraries
        do not have simulator threads.

        Args:
            config: Configuration of the environment.
            ranges: Values of the fields.
        """
        given = {name: value for name, value in ranges.items() if value is not None}
        sizes = powers_of_two(usable_processors())
        single = is_paced(config.environment_kwargs.get("simulator"))
        given.setdefault("num_envs", (1,) if single else _NUM_ENVS)
        without_threads = decide_threads(config).simulator is None or max(given["num_envs"]) == 1
        given.setdefault("threads", () if without_threads else sizes)
        given.setdefault("processes", sizes)
        return cls(**given)


def powers_of_two(highest: int) -> tuple[int, ...]:
    """Return all powers of two up to ``highest``, and ``highest`` itself."""
    return tuple(sorted({2**k for k in range(highest.bit_length())} | {highest}))
