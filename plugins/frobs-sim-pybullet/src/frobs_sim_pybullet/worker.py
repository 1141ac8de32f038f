"""The main function of a worker process."""

from __future__ import annotations

import contextlib
import pickle
import signal
import traceback
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Connection
from typing import Any

from frobs_core.description import Placement, Scene
from frobs_core.util.errors import FrobsError, SimulationError
from frobs_sim_pybullet.block import Block
from frobs_sim_pybullet.layout import Layout, arrays
from frobs_sim_pybullet.options import Engine


def portable(error: Exception) -> FrobsError:
    """Return a picklable error: the given error if it is a picklable FRobs error, otherwise a SimulationError."""
    ours = isinstance(error, FrobsError)
    if ours:
        try:
            pickle.dumps(error)
        except Exception:  # a plugin's error may have fields that cannot be pickled
            ours = False
    sent = (
        error
        if isinstance(error, FrobsError) and ours
        else SimulationError(f"a PyBullet worker process failed: {type(error).__name__}: {error}")
    )
    sent.add_note(f"In the worker process:\n{''.join(traceback.format_exception(error))}")
    return sent


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
    """Run a block of environments, and execute requests from the pipe until the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the parent process
    block: Block | None = None
    with contextlib.suppress(EOFError, OSError):  # if the pipe is closed, errors cannot be reported
        try:
            block = Block(robots, scene, engine, arrays(fields, num_envs, buffer), ids)
            pipe.send(None)
        except Exception as error:
            pipe.send(portable(error))
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
                pipe.send(portable(error))
    if block is not None:
        block.close()
