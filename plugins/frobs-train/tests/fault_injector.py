"""Trains in child processes that kill themselves with -9 where they are told to: the product has no hooks for it.

A server that has imported everything forks a child for each line of JSON on stdin, and answers with a line on stdout:

    {"act": "train" | "resume", "path": RUN, "config": {…}, "kill": {"call": k} | {"step": n} | null}

``call``: before the k-th call that changes the file system once the first row is written; ``step``: in the n-th step of
the environments. The answer holds the exit code (−9: killed) and the calls that were made, each with its name.
"""

from __future__ import annotations

import builtins
import gc
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

CALLS = (
    (os, "mkdir"),
    (os, "replace"),
    (os, "rename"),
    (os, "fsync"),
    (os, "unlink"),
    (os, "rmdir"),
    (os, "ftruncate"),
    (shutil, "rmtree"),
    (io, "open"),
)


class FaultInjector:
    """The server, from the outside; a context manager."""

    def __enter__(self) -> FaultInjector:
        self._server = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        return self

    def __exit__(self, *error: object) -> None:
        self._server.communicate()

    def run(
        self, act: str, path: Path, config: dict[str, Any] | None = None, kill: dict[str, int] | None = None
    ) -> tuple[int, list[str]]:
        """Return the exit code of a child, and the calls that it made."""
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        order = {"act": act, "path": str(path), "config": config, "kill": kill}
        self._server.stdin.write(json.dumps(order) + "\n")
        self._server.stdin.flush()
        answer = json.loads(self._server.stdout.readline())
        return answer["code"], answer["calls"]


def _die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _watch_calls(told: int, kill_at: int | None) -> None:
    """Write the name of each call to a pipe, and die before one of them."""
    count = 0
    real_write = os.write

    def watched(name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            nonlocal count
            reads = name == "open" and not set(str(args[1] if len(args) > 1 else kwargs.get("mode", "r"))) & set("wax+")
            if not reads:
                count += 1
                real_write(told, f"{name} {Path(str(args[0])).name}\n".encode())
                if count == kill_at:
                    _die()
            return real(*args, **kwargs)

        return call

    for module, name in CALLS:
        setattr(module, name, watched(name, getattr(module, name)))


def _child(order: dict[str, Any], told: int) -> int:
    from frobs_train import RunConfig, resume, train
    from frobs_train.logs.recorder import EpisodeRecorder

    kill = order["kill"] or {}
    if "step" in kill:
        step, count = EpisodeRecorder.step, 0

        def dying(self: EpisodeRecorder, actions: Any) -> Any:
            nonlocal count
            count += 1
            if count == kill["step"]:
                _die()
            return step(self, actions)

        EpisodeRecorder.step = dying  # type: ignore[method-assign]
    watching = False

    def on_progress(progress: Any) -> None:
        nonlocal watching
        if not watching:
            watching = True
            _watch_calls(told, kill.get("call"))

    try:
        if order["act"] == "train":
            train(RunConfig(**order["config"]), order["path"], on_progress)
        else:
            resume(order["path"], on_progress=on_progress)
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def _serve() -> None:
    # Children are forked with all that is imported here.
    import torch._dynamo  # which the first optimizer imports
    from tensorboard.compat.proto import event_pb2  # noqa: F401

    import frobs_train.training.resume  # noqa: F401
    from frobs_algos_sb3 import ppo  # noqa: F401
    from frobs_train.environments import make_vector_env

    make_vector_env("frobs/Irb120Reach-v0", 1, {}).close()  # imports its plugins
    torch.set_num_threads(1)
    gc.freeze()
    for line in sys.stdin:
        reading, writing = os.pipe()
        pid = os.fork()
        if pid == 0:
            os.close(reading)
            code = _child(json.loads(line), writing)
            sys.stderr.flush()
            os._exit(code)
        os.close(writing)
        with builtins.open(reading) as calls:
            made = calls.read().splitlines()
        _, status = os.waitpid(pid, 0)
        sys.stdout.write(json.dumps({"code": os.waitstatus_to_exitcode(status), "calls": made}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    _serve()
