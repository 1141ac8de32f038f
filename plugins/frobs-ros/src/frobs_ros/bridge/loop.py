"""The simulation thread, which runs functions for other threads while these threads wait for the results."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, TypeVar

from frobs_core.util.errors import SimulationError

if TYPE_CHECKING:
    from frobs_ros.bridge.bridge import Bridge

_Result = TypeVar("_Result")
_MOST_LAG = 0.1  # lag [s] above which a slow simulation no longer tries to catch up


class Loop:
    """Loop of the simulation thread, which runs submitted functions and, unless paused, advances the simulation."""

    def __init__(self, work: Bridge, paused: bool) -> None:
        self._work, self._paused = work, paused
        self._waiting: queue.SimpleQueue[tuple[Callable[[], Any], Future[Any]] | None] = queue.SimpleQueue()
        self._open = True
        self._gate = threading.Lock()
        self._began = (0.0, 0.0)
        self._thread = threading.Thread(target=self._run, name="simulation", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    @property
    def paused(self) -> bool:
        """Whether simulated time is paused."""
        return self._paused

    def set_paused(self, paused: bool) -> None:
        """Pause or unpause simulated time. Call only from the simulation thread."""
        self._paused = paused
        self.keep_pace()

    def keep_pace(self) -> None:
        """Restart the pace measurement, for example after the speed or the simulated time has changed."""
        self._began = time.monotonic(), self._work.time

    def call(self, function: Callable[[], _Result]) -> _Result:
        """Run a function in the simulation thread, and return its result or raise its exception.

        Raises:
            SimulationError: The loop has ended.
        """
        done: Future[_Result] = Future()
        with self._gate:
            if not self._open:
                raise SimulationError("the simulation has been shut down.")
            self._waiting.put((function, done))
        return done.result()

    def close(self, last: Callable[[], None] = lambda: None) -> None:
        """Stop the simulation thread. Waiting callers receive an error. Closing again has no effect.

        Args:
            last: Function that the simulation thread calls before it stops, to release the thread's resources. The
                function is not called if the thread was never started.
        """
        done: Future[None] = Future()
        with self._gate:
            if not self._open:
                return
            self._open = False
            self._waiting.put((last, done))
            self._waiting.put(None)
        if threading.current_thread() is not self._thread and self._thread.ident is not None:
            self._thread.join()
            done.result()

    def _run(self) -> None:
        self.keep_pace()
        while True:
            patience = self._patience()
            try:
                item = self._waiting.get(block=patience != 0.0, timeout=patience)
            except queue.Empty:
                self._advance()
                continue
            if item is None:
                self._refuse_the_rest()
                return
            self._do(*item)

    def _lag(self) -> float:
        """Return how far the simulation is behind its pace [s], which is negative if the simulation is ahead."""
        speed, (wall, simulated) = self._work.speed, self._began
        return time.monotonic() - wall - (self._work.time - simulated) / speed if speed > 0.0 else 0.0

    def _patience(self) -> float | None:
        """Return how long to wait for requests [s], or None for no limit."""
        return None if self._paused else max(0.0, -self._lag())

    def _advance(self) -> None:
        if self._paused:
            return
        speed, lag = self._work.speed, self._lag()
        if lag > _MOST_LAG:
            self.keep_pace()
        try:
            self._work.advance(max(0.0, lag) * speed if speed > 0.0 else 1.0)
        except Exception as error:  # services must keep running after an engine or controller error
            self._paused = True
            self._work.fail(error)

    @staticmethod
    def _do(function: Callable[[], Any], done: Future[Any]) -> None:
        try:
            done.set_result(function())
        except BaseException as error:
            done.set_exception(error)
            if not isinstance(error, Exception):
                raise

    def _refuse_the_rest(self) -> None:
        while not self._waiting.empty():
            item = self._waiting.get()
            if item is not None:
                item[1].set_exception(SimulationError("the simulation has been shut down."))
