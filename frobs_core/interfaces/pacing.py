"""The clock of a paced simulator: deadlines, and how many were missed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np

from frobs_core.arrays import Floats


class Pacer:
    """Waits for the world at the end of each step, and counts the deadlines that came too soon.

    A step must be called before the previous step's end plus its own duration: this is its deadline, at which it returns.
    A step that is called later ends at the next deadline that is still ahead. The first step after :meth:`restart` has no
    deadline to miss.

    Args:
        clock: Returns the time of the world [s].
        sleep: Waits for some time of the world [s].

    Attributes:
        time: (1,) [s] from the start of the first step after a restart to the end of the last one.
        missed: Deadlines missed since the restart.
        lateness: How late the steps since the restart were called, in total [s].
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._clock, self._sleep = clock, sleep
        self.restart()

    def restart(self) -> None:
        """Forget the time and what was missed: an episode begins."""
        self.time: Floats = np.zeros(1)
        self.missed, self.lateness = 0, 0.0
        self._deadline: float | None = None

    def wait(self, duration: float) -> None:
        """Wait until a step has taken its time.

        Args:
            duration: Of the step [s], > 0.
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
