"""Runs blocks of environments in several processes, which receive calls through pipes and share memory.

The first block runs in this process, because a process that only waits for workers would waste a processor, and because
each message to a worker takes about a tenth as long as a step.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import weakref
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from types import ModuleType
from typing import Any

import numpy as np

from frobs_core.description import Placement, Scene
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SimulationError
from frobs_sim_pybullet.block import Block
from frobs_sim_pybullet.layout import Layout, arrays
from frobs_sim_pybullet.options import Engine
from frobs_sim_pybullet.worker import work

CONTEXT = multiprocessing.get_context("spawn")  # forking would copy locks but not the threads that hold them

_GRACE = 5.0  # [s] time for a worker to exit by itself after its pipe is closed


def count_workers(num_envs: int, num_threads: int) -> int:
    """Return the number of processes for a simulation, including this process.

    Args:
        num_envs: ≥ 1.
        num_threads: Maximum number of processes, or 0 for one per processor.
    """
    if multiprocessing.current_process().daemon:
        return 1  # daemonic processes, such as workers of Gymnasium's AsyncVectorEnv, cannot have child processes
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(num_envs, num_threads or usable)


class Pool:
    """A pool of environment blocks that has the interface of a single block.

    The first block runs in this process, and each of the other blocks runs in a worker process. Workers never outlive
    the pool. A worker exits when its pipe is closed by :meth:`close` or by the garbage collector, or when this process
    exits.

    Raises:
        SimulationError: A worker did not start.
        FrobsError: A worker raised the error while it built its environments.
    """

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        engine: Engine,
        fields: Layout,
        num_envs: int,
        buffer: Any,
        count: int,
    ) -> None:
        self._ids = [part.tolist() for part in np.array_split(np.arange(num_envs), count)]
        self._owner = np.repeat(np.arange(count), [len(part) for part in self._ids])
        self._pipes: list[Connection] = []
        self.processes: list[BaseProcess] = []
        self._failure: SimulationError | None = None
        self._end = weakref.finalize(self, _end, self.processes, self._pipes)
        for number, ids in enumerate(self._ids[1:]):
            here, there = CONTEXT.Pipe()
            arguments = (there, dict(robots), scene, engine, fields, num_envs, buffer, ids)
            process = CONTEXT.Process(target=work, args=arguments, name=f"frobs-pybullet-{number}", daemon=True)
            self._pipes.append(here)
            self.processes.append(process)
            try:
                with _without_main():
                    process.start()
            except BaseException:
                self.processes.pop()
                self._end()
                raise
            finally:
                there.close()  # otherwise, reading from the pipe would not end when the worker exits
        try:
            self._own = Block(robots, scene, engine, arrays(fields, num_envs, buffer), self._ids[0])
        except BaseException:
            self._end()
            raise
        try:
            self._collect(range(len(self._pipes)), "the start")
        except BaseException:
            self._own.close()
            raise

    def step(self, decimation: int, rows: Mapping[str, Floats]) -> None:
        """Advance all environments.

        Args:
            decimation: Number of physics steps.
            rows: Commands for each physics step, (num_envs, decimation, dof), by robot. Robots may be omitted.
        """
        parts = [{name: row[ids[0] : ids[-1] + 1] for name, row in rows.items()} for ids in self._ids]
        with self._asked({number: ("step", decimation, part) for number, part in enumerate(parts[1:])}, "step"):
            self._own.step(decimation, parts[0])

    def call(self, method: str, ids: Sequence[int], arguments: Sequence[Any]) -> list[Any]:
        """Call a method on several worlds. See :meth:`frobs_sim_pybullet.block.Block.call`."""
        owners = self._owner[list(ids)]
        results: list[Any] = [None] * len(owners)
        calls: dict[int, tuple[str, list[int], list[Any]]] = {}
        for number in map(int, np.unique(owners)):
            mine = np.flatnonzero(owners == number)
            own = [argument[mine] if isinstance(argument, np.ndarray) else argument for argument in arguments]
            calls[number - 1] = (method, [ids[i] for i in mine.tolist()], own)
        here = calls.pop(-1, None)
        with self._asked({number: ("call", *call) for number, call in calls.items()}, method) as answers:
            if here is not None:
                answers[-1] = self._own.call(*here)
        for number, answer in answers.items():
            for i, result in zip(np.flatnonzero(owners == number + 1), answer, strict=True):
                results[i] = result
        return results

    @contextmanager
    def _asked(self, messages: Mapping[int, Any], what: str) -> Iterator[dict[int, Any]]:
        """Send messages to workers, run the ``with`` block, and add the workers' answers to the yielded dictionary."""
        for number, message in messages.items():
            self._send(number, message, what)
        answers: dict[int, Any] = {}
        try:
            yield answers
        finally:  # each message is answered, even after an error, so read all answers
            answers.update(zip(messages, self._collect(list(messages), what), strict=True))

    def _send(self, number: int, message: Any, what: str) -> None:
        if self._failure is not None:
            raise self._failure
        try:
            self._pipes[number].send(message)
        except OSError:
            self._fail(number, what)

    def _collect(self, numbers: Sequence[int], what: str) -> list[Any]:
        """Wait until all workers have answered, and return the answers or raise the first error among them."""
        answers: dict[int, Any] = {}
        waiting: dict[Any, int] = {self._pipes[number]: number for number in numbers}
        while waiting:  # waiting for all workers at once detects dead workers even if others are busy
            for pipe in wait(list(waiting)):
                number = waiting.pop(pipe)
                try:
                    answers[number] = self._pipes[number].recv()
                except (EOFError, OSError):
                    self._fail(number, what)
        replies = [answers[number] for number in numbers]
        for failure in replies:
            if not isinstance(failure, Exception):
                continue
            self._failure = SimulationError("a worker process of this simulation has failed; create a new simulation.")
            self.close()
            raise failure
        return replies

    def _fail(self, number: int, what: str) -> None:
        """Raise an error that describes how a worker exited."""
        process = self.processes[number]
        process.join(_GRACE)
        code = process.exitcode
        how = "closed its pipe" if code is None else f"ended with exit code {code}"
        if code is not None and code < 0:
            with contextlib.suppress(ValueError):
                how = f"was killed by {signal.Signals(-code).name}"
        ids = self._ids[number + 1]
        self._failure = SimulationError(
            f"the PyBullet worker process of environments {ids[0]} to {ids[-1]} {how} during {what}; "
            "create a new simulation."
        )
        self.close()
        raise self._failure

    def close(self) -> None:
        """Stop the workers and disconnect from Bullet. Repeated calls have no effect."""
        self._end()
        self._own.close()


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the user's main script from a new process, which would otherwise run the script again."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _end(processes: Sequence[BaseProcess], pipes: Sequence[Connection]) -> None:
    for pipe in pipes:
        pipe.close()
    for process in processes:
        process.join(_GRACE)
        if process.is_alive():
            process.kill()
            process.join()
