"""Measures the duration of actions."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Latency:
    """Latency statistics of the most recent actions, measured from the observation to the action.

    Attributes:
        median: Median latency [ms].
        percentile_95: 95th percentile of the latency [ms].
        largest: Maximum latency [ms].
        actions: Number of measured actions. If no actions were measured, all other values are NaN.
    """

    median: float
    percentile_95: float
    largest: float
    actions: int

    def __str__(self) -> str:
        """Return the statistics as a single line."""
        if not self.actions:
            return "no action yet"
        return (
            f"median {self.median:.3f} ms, 95 % within {self.percentile_95:.3f} ms, maximum {self.largest:.3f} ms "
            f"over {self.actions:,} actions"
        )


class LatencyWindow:
    """Stores the durations of the most recent actions."""

    def __init__(self, size: int = 1000) -> None:
        self._seconds: deque[float] = deque(maxlen=size)

    def add(self, seconds: float) -> None:
        """Add the duration of an action [s]."""
        self._seconds.append(seconds)

    def read(self) -> Latency:
        """Return the statistics of the stored durations."""
        if not self._seconds:
            return Latency(median=float("nan"), percentile_95=float("nan"), largest=float("nan"), actions=0)
        milliseconds = 1e3 * np.array(self._seconds)
        return Latency(
            median=float(np.median(milliseconds)),
            percentile_95=float(np.percentile(milliseconds, 95)),
            largest=float(milliseconds.max()),
            actions=len(milliseconds),
        )
