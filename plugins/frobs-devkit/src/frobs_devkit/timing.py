"""Measures the time spent in methods, compares speeds, and describes the machine."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

_ENOUGH = 0.9  # fraction of the highest measured speed that is considered fast enough


class Stopwatch:
    """Stopwatch that measures the time spent in methods of arbitrary objects, grouped by part.

    If a timed method calls a timed method of another part, the time of the inner call counts only toward the inner
    part. ``times`` contains the time of each call [s] for each part.
    """

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {}
        self._open: list[tuple[str, list[float]]] = []  # calls in progress, each with the times of its nested calls

    def watch(self, part: str, owner: Any, method: str, *, wait: bool = False) -> None:
        """Replace a method of ``owner`` with a wrapper that adds the time of each call to a part.

        With ``wait``, the time includes computations that JAX or CUDA performs in the background.
        """
        original: Callable[..., Any] = getattr(owner, method)
        times = self.times.setdefault(part, [])

        def timed(*args: Any, **kwargs: Any) -> Any:
            if self._open and self._open[-1][0] == part:
                return original(*args, **kwargs)
            inner: list[float] = []
            self._open.append((part, inner))
            start = perf_counter()
            try:
                result = original(*args, **kwargs)
                if wait:
                    _wait_for(result)
            finally:
                elapsed = perf_counter() - start
                self._open.pop()
                if self._open:
                    self._open[-1][1].append(elapsed)
                times.append(elapsed - sum(inner))
            return result

        setattr(owner, method, timed)

    def seconds(self, part: str) -> float:
        """Return the total time spent in a part [s]."""
        return sum(self.times.get(part, ()))

    def clear(self) -> None:
        """Set all times to zero."""
        for times in self.times.values():
            times.clear()


def choose_num_envs(rates: Mapping[int, float]) -> int:
    """Return the smallest number of environments that is fast enough, given the steps per second of each number."""
    return min(size for size, rate in rates.items() if rate >= _ENOUGH * max(rates.values()))


def machine() -> str:
    """Return a one-line description of the processor, the operating system and the Python version."""
    return f"{_processor()}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


def _wait_for(result: Any) -> None:
    """Wait for pending JAX and CUDA computations, without importing JAX or PyTorch."""
    jax, torch = sys.modules.get("jax"), sys.modules.get("torch")
    if jax is not None:
        jax.block_until_ready(result)
    if torch is not None and torch.cuda.is_initialized():
        torch.cuda.synchronize()


def _processor() -> str:
    """Return the processor name, or the machine type if the system does not report a processor name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())
