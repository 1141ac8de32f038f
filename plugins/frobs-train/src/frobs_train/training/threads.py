"""Who gets which processor: decided here, once, for simulator, algorithm and worker processes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from frobs_core import registry
from frobs_core.validation import whole_number
from frobs_train.configuration.config import RunConfig

_most: int | None = None  # processors that a runner allows


@dataclass(frozen=True, kw_only=True)
class Threads:
    """How the processors are shared.

    Attributes:
        processors: That this process may use.
        simulator: Threads, or worker processes, that step the environments; None: the environment is not ours.
        torch: Threads of the algorithm's library; None: the algorithm does not say.
    """

    processors: int
    simulator: int | None
    torch: int | None

    def __str__(self) -> str:
        """Say it in half a line."""
        shares = [("simulator", self.simulator), ("torch", self.torch)]
        named = ", ".join(f"{name} {_count(number, 'thread')}" for name, number in shares if number is not None)
        return _count(self.processors, "processor") + (f": {named}" if named else "")

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return asdict(self)


@contextmanager
def processors_limited_to(count: int) -> Iterator[None]:
    """Let this process believe that it may use at most so many processors, because jobs run side by side."""
    global _most
    before, _most = _most, count
    try:
        yield
    finally:
        _most = before


def usable_processors() -> int:
    """Return how many processors this process may use: its share of a container, batch job or runner."""
    found = _affinity()
    return found if _most is None else min(found, _most)


def _affinity() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def decide_threads(config: RunConfig) -> Threads:
    """Decide who gets which processors.

    The simulator gets what ``threads.simulator`` or the keyword ``num_threads`` of the environment says, else every
    processor, but no more than there are environments. The algorithm has its own in its settings (``torch_threads``,
    one by default: small networks are fastest so), for another number of theirs may round differently.
    """
    processors = usable_processors()
    simulator = None
    if config.environment.removeprefix("frobs_core:") in registry.environments():
        chosen = config.threads.simulator or config.environment_kwargs.get("num_threads") or processors
        simulator = max(1, min(whole_number("environment_kwargs.num_threads", chosen), config.num_envs))
    torch = config.algorithm_config.get("torch_threads")
    return Threads(processors=processors, simulator=simulator, torch=torch)


def _count(number: int, name: str) -> str:
    return f"{number} {name}" if number == 1 else f"{number} {name}s"
