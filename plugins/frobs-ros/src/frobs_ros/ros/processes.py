"""Starts and ends child processes. This module never ends processes that were not started by this process.

Each child process runs under a guard (:mod:`frobs_ros.ros.guard`). The guard ends the child process and all its
descendants on request, or when the process that started them ends for any reason, including ``kill -9``.
"""

from __future__ import annotations

import atexit
import contextlib
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import IO

from frobs_ros.errors import ProcessError
from frobs_ros.ros import LOG
from frobs_ros.ros.environment import child_variables
from frobs_ros.ros.guard import descendants

_GUARD = Path(__file__).with_name("guard.py")
_TAIL = 2_000
_POLL = 0.02
_owned: dict[int, Process] = {}
_lock = threading.Lock()
_numbers = itertools.count(1)
_collecting: ContextVar[list[Process] | None] = ContextVar("collecting", default=None)


class Process:
    """A command that this process started, including all the command's child processes.

    Args:
        kind: Purpose of the command: ``"master"``, ``"launch"``, ``"node"``, ``"gazebo"`` or ``"state publisher"``.
        name: Name of the command in messages.
        popen: The guard process.
        log: File that contains the command's output, or None if the output is not stored in a file.
        grace: Time to wait for the command to end after SIGINT, and again after SIGTERM [s].

    Attributes:
        owner: ID of the process that started the command. Forks of this process must not end the command.
    """

    def __init__(self, kind: str, name: str, popen: subprocess.Popen[bytes], log: Path | None, grace: float) -> None:
        self.kind = kind
        self.name = name
        self.log = log
        self.owner = os.getpid()
        self._popen = popen
        self._grace = grace
        self._stopped = False
        self.in_window = False

    @property
    def pid(self) -> int:
        """Process ID of the guard, which is the ancestor of all the command's processes."""
        return self._popen.pid

    @property
    def is_running(self) -> bool:
        """Whether the command or any of its child processes is running."""
        return self.returncode is None

    @property
    def returncode(self) -> int | None:
        """Exit code of the command, or None while the command is running."""
        code = self._popen.poll()
        if code is not None:
            self._let_go()
        return code

    def pids(self) -> set[int]:
        """Return the IDs of the command's processes."""
        return set(descendants(self.pid)) if self.is_running else set()

    def stop(self) -> bool:
        """End the command with SIGINT, then SIGTERM, then SIGKILL. Further calls have no effect.

        Returns:
            Whether all the command's processes have ended.
        """
        if os.getpid() != self.owner:
            return False
        self._stopped = True
        self._let_go()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._popen.wait(2 * self._grace + 5.0)
        _owned.pop(self.pid, None)
        return not self.is_running

    def _let_go(self) -> None:
        """Close the pipe to the guard, which makes the guard end all the command's processes."""
        if self._popen.stdin is not None:
            with contextlib.suppress(OSError):
                self._popen.stdin.close()

    def report_end(self) -> None:
        """Wait until the command has ended, and log its last output if it failed by itself."""
        code = self._popen.wait()
        if self._stopped or not (code or self.in_window):
            return
        said = "its window was closed" if self.in_window else f"exit code {code}"  # xterm hides the exit code
        LOG.error("%s ended by itself: %s. Last output:\n%s", self.name, said, self.output() or "(nothing)")

    def output(self) -> str:
        """Return the end of the command's output, or an empty string if the output is not stored."""
        if self.log is None:
            return ""
        with contextlib.suppress(OSError):
            return self.log.read_bytes()[-_TAIL:].decode(errors="replace").strip()
        return ""

    def wait_until(self, ready: Callable[[], bool], timeout: float) -> None:
        """Wait until a condition holds.

        Raises:
            ProcessError: The process ended, or it was ended because the condition did not hold within ``timeout`` [s].
        """
        until = time.monotonic() + timeout
        while not ready():
            if not self.is_running:
                raise ProcessError(
                    self.name, f"the process ended immediately with exit code {self.returncode}", self.output()
                )
            if time.monotonic() > until:
                self.stop()
                raise ProcessError(
                    self.name, f"the process was not ready after {timeout:g} s and was stopped", self.output()
                )
            time.sleep(_POLL)


def wait_for(condition: Callable[[], object], timeout: float, poll: float = _POLL) -> bool:
    """Wait until a condition holds, for at most ``timeout`` [s], and return whether the condition holds."""
    until = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > until:
            return False
        time.sleep(poll)
    return True


def start(
    kind: str,
    command: Sequence[str | Path],
    *,
    name: str,
    terminal: bool = False,
    output: str | None = "log",
    environment: Mapping[str, str] | None = None,
    respawn: bool = False,
    grace: float = 5.0,
) -> Process:
    """Start a command whose processes all end when this process ends.

    Args:
        kind: Purpose of the command, as in :class:`Process`.
        command: Program and its arguments.
        name: Name of the command in messages, and title of its window.
        terminal: Whether to run the command in an xterm window. If xterm or a display is missing, the output is
            written to a file, and the path of the file is logged.
        output: Destination of the command's output: ``"screen"`` for the output of this process, ``"log"`` for a file,
            or None to discard the output. Ignored if ``terminal`` is true.
        environment: Environment variables. By default, the variables for ROS programs are used.
        respawn: Whether to restart the command when it ends by itself.
        grace: Time to wait for the command to end after SIGINT, and again after SIGTERM [s].

    Raises:
        ProcessError: The program is not installed.
    """
    variables = dict(environment) if environment is not None else child_variables()
    words = [str(word) for word in command]
    program = shutil.which(words[0], path=variables.get("PATH"))
    if program is None:
        raise ProcessError(name, f"the program '{words[0]}' is not installed; run 'frobs doctor ros' for details")
    words[0] = program
    options = ["--grace", str(grace), *(["--respawn"] if respawn else [])]
    log = None
    if terminal or output == "log":
        log = log_folder() / f"{name.strip('/').replace('/', '-').replace(' ', '-') or kind}-{next(_numbers)}.log"
    window = _window(name, log, variables) if terminal and log else []
    if window:
        words = [*window, *words]
        options.append("--inside")
    elif terminal:
        LOG.warning("%s writes to %s", name, log)
    with contextlib.ExitStack() as stack:
        to: IO[bytes] | int | None = None if output == "screen" else subprocess.DEVNULL
        if log is not None and not window:  # xterm writes the log file itself
            to = stack.enter_context(log.open("wb"))
        popen = subprocess.Popen(
            [sys.executable, "-I", "-S", str(_GUARD), *options, *words],
            stdin=subprocess.PIPE,
            stdout=to,
            stderr=None if to is None else subprocess.STDOUT,
            env=variables,
        )
    process = Process(kind, name, popen, log, grace)
    process.in_window = bool(window)
    threading.Thread(target=process.report_end, daemon=True).start()
    with _lock:
        _owned[process.pid] = process
    collected = _collecting.get()
    if collected is not None:
        collected.append(process)
    return process


def _window(name: str, log: Path, variables: Mapping[str, str]) -> list[str]:
    """Return the command prefix that opens an xterm window, or an empty list if no window can be opened."""
    missing = "xterm is not installed" if shutil.which("xterm", path=variables.get("PATH")) is None else ""
    if not variables.get("DISPLAY"):
        missing = "there is no display"
    if missing:
        LOG.warning("%s runs without a separate window: %s", name, missing)
        return []
    return ["xterm", "-T", name, "-l", "-lf", str(log), "-e"]


def log_folder() -> Path:
    """Return the folder for the log files of the started commands. The folder is created on first use."""
    global _folder
    if _folder is None or not _folder.is_dir():
        base = os.environ.get("ROS_LOG_DIR")
        if base:
            Path(base).mkdir(parents=True, exist_ok=True)
        _folder = Path(tempfile.mkdtemp(prefix="frobs-ros-", dir=base))
    return _folder


_folder: Path | None = None


def owned(kinds: Iterable[str] = ()) -> list[Process]:
    """Return the running commands that this process started, oldest first, or only commands of the given kinds."""
    selected = set(kinds)
    with _lock:
        processes = list(_owned.values())
    for process in processes:
        if not process.is_running:
            _owned.pop(process.pid, None)
    return [p for p in processes if p.is_running and p.owner == os.getpid() and (not selected or p.kind in selected)]


def stop(processes: Iterable[Process]) -> bool:
    """End the given processes, newest first.

    Returns:
        Whether all processes have ended.
    """
    ended = [process.stop() for process in reversed(list(processes))]  # a list, to stop all processes
    return all(ended)


@contextlib.contextmanager
def collected() -> Iterator[list[Process]]:
    """Collect the processes that are started in this context, and end them if an exception is raised."""
    processes: list[Process] = []
    token = _collecting.set(processes)
    try:
        yield processes
    except BaseException:
        stop(processes)
        raise
    finally:
        _collecting.reset(token)


@atexit.register
def _stop_all() -> None:
    stop(owned())
