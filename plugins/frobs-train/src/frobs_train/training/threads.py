"""Distribute the processors among simulator, algorithm and worker processes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from frobs_core.plugins import registry
from frobs_core.util.validation import whole_number
from frobs_train.configuration.config import RunConfig

_most: int | None = None  # maximum number of processors, set by a runner


@dataclass(frozen=True, kw_only=True)
class Threads:
    """Distribution of the processors.

    Attributes:
        processors: Number of processors that this process may use.
        simulator: Number of threads or worker processes that step the environments, or None if they have none.
        torch: Number of threads of the algorithm's library, or None if the algorithm has no such setting.
    """

    processors: int
    simulator: int | None
    torch: int | None

    def __str__(self) -> str:
        shares = [("simulator", self.simulator), ("torch", self.torch)]
        named = ", ".join(f"{name} {_count(number, 'thread')}" for name, number in shares if number is not None)
        return _count(self.processors, "processor") + (f": {named}" if named else "")

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as JSON-serializable values."""
        return asdict(self)


@contextmanager
def processors_limited_to(count: int) -> Iterator[None]:
    """Limit the number of processors that this process uses, because other jobs run at the same time."""
    global _most
    before, _most = _most, count
    try:
        yield
    finally:
        _most = before


def usable_processors() -> int:
    """Return the number of processors that this process may use, as limited by CPU affinity and the runner."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return usable if _most is None else min(usable, _most)


def decide_threads(config: RunConfig) -> Threads:
    """Decide how many threads the simulator and the algorithm use.

    The number of simulator threads is ``threads.simulator``, which defaults to the environment's keyword argument
    ``num_threads`` or else to the number of processors. There is at most one simulator thread per environment. The
    number of algorithm threads is the algorithm's setting ``torch_threads``. The default is 1 on all machines, because
    a different number of threads may lead to different rounding errors. One thread is fastest for small networks.
    """
    processors = usable_processors()
    simulator = None
    if config.environment.removeprefix("frobs_core:") in registry.environments():
        chosen = config.threads.simulator or config.environment_kwargs.get("num_threads") or processors
        simulator = max(1, min(whole_number("environment_kwargs.num_threads", chosen), config.total_envs))
    torch = config.algorithm_config.get("torch_threads")
    return Threads(processors=processors, simulator=simulator, torch=torch)


def _count(number: int, name: str) -> str:
    return f"{number} {name}" if number == 1 else f"{number} {name}s"
