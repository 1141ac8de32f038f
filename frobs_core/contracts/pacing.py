"""A clock for paced simulators that counts missed deadlines."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np

from frobs_core.util.arrays import Floats


class Pacer:
    """Clock that synchronizes simulation steps with an external clock and counts missed deadlines.

    A step's deadline is the end of the previous step plus the step's own duration. A step that is called before its
    deadline returns at that deadline. A step that is called too late returns at the next deadline in the future. The
    first step after :meth:`restart` cannot miss a deadline.

    Args:
        clock: Function that returns the time of the external clock [s].
        sleep: Function that waits for a given duration on the external clock [s].

    Attributes:
        time: Time from the start of the first step after a restart to the end of the latest step, (1,) [s].
        missed: Number of missed deadlines since the restart.
        lateness: Sum of the delays of all late steps since the restart [s].
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._clock, self._sleep = clock, sleep
        self.restart()

    def restart(self) -> None:
        """Reset the time and the statistics at the start of an episode."""
        self.time: Floats = np.zeros(1)
        self.missed, self.lateness = 0, 0.0
        self._deadline: float | None = None

    def wait(self, duration: float) -> None:
        """Wait until a step has taken its full duration.

        Args:
            duration: Duration of the step [s], > 0.
        """
        now = self._clock()
        before = now if self._deadline is None else self._deadline
        late = now - (before + duration)
        missed = max(0, int(np.ceil(late / duration)))
        self.missed += missed
        self.lateness += max(0.0, late)
        self._deadline = before + (1 + missed) * duration
        self.time = self.time + (1 + missed) * duration
        while (left := self._deadline - self._clock()) > 0.0:
            self._sleep(left)

    def info(self) -> Mapping[str, Floats]:
        """Return ``missed_deadlines`` and ``lateness`` [s] since the restart, (1,) each, for the ``info`` of a step."""
        return {"missed_deadlines": np.array([float(self.missed)]), "lateness": np.array([self.lateness])}
