"""Program that each measured process runs: it steps environments and writes the results to a file.

The program reads its task as JSON from standard input. All processes of a measurement share a folder, in which files
indicate the progress of each process. Each measurement runs in a separate process, so that its peak memory can be
measured.
"""

from __future__ import annotations

import json
import os
import platform
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from frobs_core.util.files import write_text
from frobs_core.util.plain import to_json

_POLL = 0.005  # [s]
_BUSY = 0.02  # [s] interval between checks of whether all processes are done
_WARM_UP = 0.2  # [s]
_STAMPS = 100  # number of clock readings during the measurement


def main() -> None:
    """Read the task from standard input and run it."""
    task = json.load(sys.stdin)
    folder, index = Path(task["folder"]), task["index"]
    try:
        result = step(task["config"], folder, task)
    except Exception as error:  # the process that waits for the results reports the error
        write_text(folder / f"error-{index}", str(error) or type(error).__name__)
        raise SystemExit(1) from None
    write_text(folder / f"result-{index}.json", to_json(result))


def step(config: Mapping[str, Any], folder: Path, task: Mapping[str, Any]) -> dict[str, Any]:
    """Step environments at the same time as the other processes.

    The result has ``stamps`` (pairs of Unix time [s] and number of environment steps completed by then), ``memory``
    (peak memory [B]), ``processors`` (processor time ÷ elapsed time) and ``startup`` (startup time [s]).
    """
    from frobs_train import RunConfig, make_training_env

    made = RunConfig(**config)
    with closing(make_training_env(made)) as env:
        env.action_space.seed(task["index"])
        actions = [env.action_space.sample() for _ in range(16)]
        env.reset(seed=task["index"])
        count = 0

        def advance() -> None:
            nonlocal count
            env.step(actions[count % len(actions)])
            count += 1

        warm = time.perf_counter()
        while count < 3 or time.perf_counter() < warm + _WARM_UP:
            advance()
        startup = time.time() - _WARM_UP - task["launched"]
        _meet(folder, task)
        used, start = time.process_time(), time.perf_counter()
        stamps = _record(task["seconds"], advance, lambda: count)
        share = (time.process_time() - used) / (time.perf_counter() - start)
        _touch(folder, "done", task)
        end = time.monotonic() + task["seconds"] + task["patience"]  # a killed process never writes its "done" file
        while not _all(folder, "done", task) and time.monotonic() < end:  # keep the processor busy
            stamps += _record(_BUSY, advance, lambda: count)
    return {
        "stamps": [(moment, steps * made.total_envs) for moment, steps in stamps],
        "memory": peak_memory(),
        "processors": share,
        "startup": max(0.0, startup),
    }


def peak_memory() -> int:
    """Return the peak resident memory of this process [B].

    On Linux, ``ru_maxrss`` also reports a peak, but this peak includes the memory of the parent process.
    """
    try:
        lines = Path("/proc/self/status").read_text("utf-8").splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        import resource

        unit = 1 if platform.system() == "Darwin" else 1024
        return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _record(seconds: float, advance: Callable[[], None], count: Callable[[], int]) -> list[tuple[float, int]]:
    """Step the environments for a given time, and return pairs of a time [s] and the steps completed by then."""
    stamps = [(time.time(), count())]
    end, next_stamp = stamps[0][0] + seconds, stamps[0][0] + seconds / _STAMPS
    now = 0.0
    while now < end:
        advance()
        now = time.time()
        if now >= min(next_stamp, end):
            stamps.append((now, count()))
            next_stamp = now + seconds / _STAMPS
    return stamps


def _meet(folder: Path, task: Mapping[str, Any]) -> None:
    _touch(folder, "ready", task)
    end = time.monotonic() + task["patience"]
    while not _all(folder, "ready", task):
        if time.monotonic() > end:
            here = len(list(folder.glob("ready-*")))
            raise TimeoutError(
                f"only {here} of {task['count']} processes started within {task['patience']:.0f} s; "
                "there may be too few free processors."
            )
        time.sleep(_POLL)


def _all(folder: Path, name: str, task: Mapping[str, Any]) -> bool:
    names = os.listdir(folder)
    failed = next((other for other in names if other.startswith("error-")), None)
    if failed is not None:
        raise RuntimeError((folder / failed).read_text("utf-8"))
    here = sum(other.startswith(f"{name}-") for other in names)
    return here >= int(task["count"])


def _touch(folder: Path, name: str, task: Mapping[str, Any]) -> None:
    (folder / f"{name}-{task['index']}").touch()


if __name__ == "__main__":
    main()
