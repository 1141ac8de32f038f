"""Runs commands of ``frobs`` in processes that are forked from one that has imported everything, within limits.

    python server.py [FOLDER ...]

The folders are put on the import path, for commands of further distributions. Orders and results are lines of JSON on
stdin and stdout; :class:`Server` writes and reads them.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import importlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any, NoReturn

sys.path.insert(0, str(Path(__file__).parents[1] / "cookiecutter"))
sys.path.insert(0, str(Path(__file__).parent))

import guard
from fork_server import LIBRARIES

CPU_SECONDS = 5.0
"""CPU time after which a command must have ended, unless it simulates or trains [s]."""

IDLE_SECONDS = 10.0
"""Time after which a command that waits without using the processor counts as blocked [s]."""

WALL_SECONDS = 300.0
"""Time after which a command ends on any machine [s]."""

UNOBSERVED_SECONDS = 0.5
"""Time for which a command is not observed, because most end sooner and looking at processes takes time [s]."""

GROWTH = 2**30
"""Maximum growth of the memory of a command [bytes]."""

ADDRESSES = 8 * 2**30
"""Address space that a command can add, so that a single allocation cannot exhaust the machine [bytes]."""

OUTSIDE = {"secret.txt": "a file that no command may change\n", "plots/old.png": "a picture that nobody may replace\n"}
"""Files of the folder that links and paths of hostile inputs lead to."""

FURTHER = (
    "collada",
    "matplotlib.pyplot",
    "onnx",
    "onnxruntime",
    "onnxscript",
    "optuna",
    "pybullet",
    "torch.onnx",
    "trimesh",
    "xacro",
)
"""Libraries that commands import. Others are imported in advance once a command has imported them."""

TICK = os.sysconf("SC_CLK_TCK")


class Server:
    """The client of a server process.

    Args:
        paths: Folders to put on the import path.
    """

    def __init__(self, paths: Sequence[Path] = ()) -> None:
        environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, __file__, *map(str, paths)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()

    def run(self, folder: Path, words: Sequence[str], **limits: float) -> dict[str, Any]:
        """Run ``frobs WORDS`` in ``folder/work`` and return what happened.

        Args:
            folder: Folder of the case. :func:`prepare` must have been called.
            words: Command line without ``frobs``.
            **limits: ``cpu`` [s], ``idle`` [s] or ``growth`` [bytes] instead of the constants of this module.

        Returns:
            ``code`` (exit code, or null if it was killed), ``killed`` (slow, blocked, growth or empty), ``cpu`` [s],
            ``growth`` [bytes], ``stdout``, ``stderr``, ``stack`` (of a command that was killed), ``events`` of the guard,
            ``modules`` that the command imported.
        """
        result = self._ask({"folder": str(folder), "words": list(words), **limits})
        for name in ("stdout", "stderr", "stack"):
            data = (folder / name).read_bytes()[: 2**22]
            result[name] = data.decode("utf-8", "surrogateescape")
        result["events"] = [json.loads(line) for line in (folder / "events").read_text().splitlines()]
        result["events"] += [["write", f"found afterwards: {name}"] for name in changed(folder)]
        return result

    def preload(self, modules: Sequence[str]) -> None:
        """Import modules, so that later commands need not import them."""
        self._ask({"preload": list(modules)})

    def _ask(self, order: dict[str, Any]) -> dict[str, Any]:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(order).encode() + b"\n")
        self._process.stdin.flush()
        answer: dict[str, Any] = json.loads(self._process.stdout.readline())
        return answer


def prepare(folder: Path) -> Path:
    """Make the folders of a case, empty, and return the working directory of its command."""
    with contextlib.suppress(FileNotFoundError):
        shutil.rmtree(folder)
    for name in ("work", "home", "cache", "tmp"):
        (folder / name).mkdir(parents=True)
    for name, text in OUTSIDE.items():
        path = folder / "outside" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder / "work"


def changed(folder: Path) -> list[str]:
    """Return what was changed outside of the folders in which a command may write."""
    ours = {"work", "home", "cache", "tmp", "outside", "stdout", "stderr", "stack", "events", "modules"}
    found = [name for name in os.listdir(folder) if name not in ours]
    found += [f"home/{name}" for name in os.listdir(folder / "home")]
    there = {
        path.relative_to(folder / "outside").as_posix(): path.read_text(errors="replace")
        for path in (folder / "outside").rglob("*")
        if path.is_file()
    }
    found += [f"outside/{name}" for name in sorted(there.keys() | OUTSIDE) if there.get(name) != OUTSIDE.get(name)]
    for area in ("work", "cache", "tmp"):
        found += [str(path.relative_to(folder)) for path in (folder / area).rglob("FUZZ_EXECUTED*")]
    return found


def become(order: dict[str, Any]) -> NoReturn:
    """Run the command in this process."""
    folder = Path(order["folder"])
    os.setsid()
    for number, name in enumerate(("/dev/null", "stdout", "stderr")):
        descriptor = os.open(folder / name, os.O_RDWR | os.O_CREAT, 0o644)
        os.dup2(descriptor, number)
        os.close(descriptor)
    sys.stdin, sys.stdout = open(0, closefd=False), open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115
    os.chdir(folder / "work")
    os.environ |= {
        "HOME": str(folder / "home"),
        "XDG_CACHE_HOME": str(folder / "cache"),
        "XDG_CONFIG_HOME": str(folder / "cache"),
        "MPLCONFIGDIR": str(folder / "cache"),
        "TMPDIR": str(folder / "tmp"),
        "ROS_MASTER_URI": "http://127.0.0.1:9",
        "WANDB_MODE": "offline",
        "SDL_VIDEODRIVER": "dummy",
    }
    tempfile.tempdir = None  # which a module may have looked up in the server
    sys.argv = ["frobs", *order["words"]]
    addresses = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (addresses + ADDRESSES,) * 2)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**31,) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    stack = open(folder / "stack", "w")  # noqa: SIM115
    faulthandler.register(signal.SIGUSR1, stack)
    report = os.open(folder / "events", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    modules = os.open(folder / "modules", os.O_WRONLY | os.O_CREAT)
    known = set(sys.modules)
    guard.install(folder, [folder / name for name in ("work", "cache", "tmp")], report)
    code: object = 0
    try:
        from frobs_cli import main

        main()
    except SystemExit as exit:
        code = exit.code
    except BaseException:
        traceback.print_exc()
        code = 1
    with contextlib.suppress(Exception):
        sys.stdout.flush()
        sys.stderr.flush()
    os.write(modules, json.dumps(sorted(set(sys.modules) - known)).encode())
    os._exit(code if isinstance(code, int) else 1)


def supervise(order: dict[str, Any]) -> dict[str, Any]:
    """Fork the command and wait for its end, or end it if it exceeds a limit."""
    folder = Path(order["folder"])
    for name in ("stdout", "stderr", "stack", "events", "modules"):
        (folder / name).write_text("")
    pid = os.fork()
    if not pid:
        become(order)
    baseline = _resident(os.getpid())
    start = progress = time.monotonic()
    killed, used, pause, status, usage = "", 0.0, 0.002, 0, None
    while True:
        found, status, usage = os.wait4(pid, os.WNOHANG)
        if found:
            break
        time.sleep(pause)
        pause = min(1.3 * pause, 0.1)
        now = time.monotonic()
        if now - start < UNOBSERVED_SECONDS:
            continue
        spent, waits = _processes(pid)
        if spent > used or not waits:
            used, progress = max(used, spent), now
        if used > order.get("cpu", CPU_SECONDS):
            killed = "slow"
        elif now - progress > order.get("idle", IDLE_SECONDS) or now - start > WALL_SECONDS:
            killed = "blocked"
        elif _peak(pid) - baseline > order.get("growth", GROWTH):
            killed = "growth"
        if killed:
            _print_stack(pid, folder / "stack")
            _end(pid)
            _, status, usage = os.wait4(pid, 0)
            break
    _end(pid)
    growth = 1024 * usage.ru_maxrss - baseline
    code = os.waitstatus_to_exitcode(status)
    if not killed and growth > order.get("growth", GROWTH):
        killed = "growth"
    return {
        "code": None if killed and code < 0 else code,
        "killed": killed,
        "cpu": round(usage.ru_utime + usage.ru_stime, 3),
        "growth": max(growth, 0),
        "modules": json.loads((folder / "modules").read_text() or "[]"),
    }


def _print_stack(pid: int, file: Path) -> None:
    """Let a process write its Python stack, also while it runs native code."""
    os.kill(pid, signal.SIGUSR1)
    for _ in range(20):
        time.sleep(0.05)
        if file.stat().st_size:
            return


def _end(session: int) -> None:
    """End a command and all processes that it started."""
    for pid, fields in _session(session):
        if fields[0] != "Z":
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def _session(session: int) -> list[tuple[int, list[str]]]:
    """Return the processes of a session: the fields of ``/proc/PID/stat`` from the state on."""
    found = []
    for name in filter(str.isdigit, os.listdir("/proc")):
        with contextlib.suppress(OSError):
            fields = Path(f"/proc/{name}/stat").read_text(errors="replace").rpartition(")")[2].split()
            if int(fields[3]) == session:
                found.append((int(name), fields))
    return found


def _processes(session: int) -> tuple[float, bool]:
    """Return the CPU time of a session [s], and whether all its processes wait."""
    found = _session(session)
    spent = sum(sum(map(int, fields[11:15])) for _, fields in found) / TICK
    return spent, all(fields[0] in "SDZ" for _, fields in found)


def _resident(pid: int, key: str = "VmRSS") -> int:
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith(f"{key}:"):
                return 1024 * int(line.split()[1])
    return 0


def _peak(session: int) -> int:
    return max((_resident(pid, "VmHWM") for pid, _ in _session(session)), default=0)


def preload(modules: Sequence[str]) -> None:
    """Import modules that may not exist, and keep their memory out of later collections of garbage."""
    for name in modules:
        with contextlib.suppress(Exception):
            importlib.import_module(name)
    gc.collect()
    gc.freeze()


def main() -> None:
    """Serve orders until stdin ends."""
    orders: IO[bytes] = os.fdopen(os.dup(0), "rb")
    answers: IO[bytes] = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    sys.path[:0] = sys.argv[1:]
    sys.dont_write_bytecode = True
    preload((*LIBRARIES, *FURTHER))
    from frobs_cli.program import walk
    from frobs_core import plugins

    for kind in ("simulator", "robot", "controller", "task", "algorithm"):
        plugins.records(kind)
    for _ in walk():  # imports the commands
        pass
    preload(())
    for line in orders:
        order = json.loads(line)
        if "preload" in order:
            preload(order["preload"])
            answer: dict[str, Any] = {}
        else:
            answer = supervise(order)
        answers.write(json.dumps(answer).encode() + b"\n")
        answers.flush()


if __name__ == "__main__":
    main()
