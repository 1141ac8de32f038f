"""What runs in a worker process."""

from __future__ import annotations

import contextlib
import pickle
import signal
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from frobs_core.errors import FrobsError, SimulationError
from frobs_core.interfaces import Placement, Scene
from frobs_sim_pybullet.block import Block
from frobs_sim_pybullet.layout import Layout, arrays
from frobs_sim_pybullet.options import Engine


@dataclass(frozen=True)
class Failure:
    """An error of a worker, in a form that travels.

    Attributes:
        kind: Class of the error, where it is one of ours.
        fields: What it holds.
        text: What it says.
        trace: Where it happened.
    """

    kind: type[FrobsError] | None
    fields: Mapping[str, Any]
    text: str
    trace: str

    @classmethod
    def of(cls, error: BaseException) -> Failure:
        """Return what can be sent of an error."""
        kind, fields = (type(error), dict(vars(error))) if isinstance(error, FrobsError) else (None, {})
        try:
            pickle.dumps((kind, fields))
        except Exception:  # a field of a plugin's own error, of any kind
            kind, fields = None, {}
        text = str(error) if kind else f"{type(error).__name__}: {error}"
        return cls(kind, fields, text, "".join(traceback.format_exception(error)))

    def error(self) -> FrobsError:
        """Return the error again; one that is not ours as a SimulationError."""
        if self.kind is None:
            error: FrobsError = SimulationError(f"a PyBullet worker process failed: {self.text}")
        else:
            error = self.kind.__new__(self.kind)
            Exception.__init__(error, self.text)
            vars(error).update(self.fields)
        error.add_note(f"In the worker process:\n{self.trace}")
        return error


def work(
    pipe: Connection,
    robots: Mapping[str, Placement],
    scene: Scene,
    engine: Engine,
    fields: Layout,
    num_envs: int,
    buffer: Any,
    ids: Sequence[int],
) -> None:
    """Hold some environments and do what the pipe says, until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that holds the other end
    block: Block | None = None
    with contextlib.suppress(EOFError, OSError):  # the other end is closed, or gone: nobody is left to tell
        try:
            block = Block(robots, scene, engine, arrays(fields, num_envs, buffer), ids)
            pipe.send(None)
        except Exception as error:
            pipe.send(Failure.of(error))
            return
        while True:
            message = pipe.recv()
            try:
                answer: Any = None
                if message[0] == "step":
                    block.step(*message[1:])
                else:
                    answer = block.call(*message[1:])
                pipe.send(answer)
            except (EOFError, OSError):
                raise
            except Exception as error:
                pipe.send(Failure.of(error))
    if block is not None:
        block.close()
