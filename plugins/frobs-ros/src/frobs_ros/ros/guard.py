"""Runs a command, and ends all of the command's processes on request or when the owner process ends.

This module is called the guard. It runs as a separate program, ``python -I -S guard.py COMMAND…``, and uses only the
standard library.
The guard's standard input is a pipe from the owner process. The pipe closes when the owner ends for any reason,
including ``kill -9``. All processes that the command starts, including daemons, remain descendants of the guard
(PR_SET_CHILD_SUBREAPER), so that the guard can end all of them.

``--respawn`` restarts the command when it ends by itself. ``--grace S`` sets the time to wait for the command to end
after SIGINT, and again after SIGTERM [s]. ``--inside`` sends SIGINT to the command's child processes instead of the
command, which is required if the command is a terminal emulator.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
import subprocess
import sys
import time

_SET_PDEATHSIG, _SET_CHILD_SUBREAPER = 1, 36
_POLL = 0.02
_LOOK = 1.0
_RESPAWN_PAUSE = 1.0


def descendants(pid: int) -> list[int]:
    """Return the IDs of a process's descendants, parents before their children."""
    children: dict[int, list[int]] = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open(f"/proc/{entry}/stat", "rb") as file:
                    fields = file.read().rpartition(b")")[2].split()
            except OSError:
                continue  # the process has ended in the meantime
            if fields[0] != b"Z":
                children.setdefault(int(fields[1]), []).append(int(entry))
    pids, todo = [], [pid]
    while todo:
        below = sorted(children.get(todo.pop(0), ()))
        pids += below
        todo += below
    return pids


def _signal(pids: list[int], number: int) -> None:
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)


def _reap() -> None:
    """Reap orphaned child processes."""
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            continue


def _wait_until_none(grace: float) -> bool:
    until = time.monotonic() + grace
    while descendants(os.getpid()):
        if time.monotonic() > until:
            return False
        time.sleep(_POLL)
        _reap()
    return True


def _end(child: subprocess.Popen[bytes], grace: float, inside: bool) -> None:
    """End the command with SIGINT, and end the processes that remain with SIGTERM and then SIGKILL."""
    if child.poll() is None:
        _signal((inside and descendants(child.pid)) or [child.pid], signal.SIGINT)
        if _wait_until_none(grace):
            return
    _signal(descendants(os.getpid()), signal.SIGTERM)
    if _wait_until_none(grace):
        return
    while rest := descendants(os.getpid()):
        _signal(rest, signal.SIGKILL)
        time.sleep(_POLL)
        _reap()


def _start(command: list[str]) -> subprocess.Popen[bytes]:
    libc = ctypes.CDLL(None, use_errno=True)

    def prepare() -> None:
        libc.prctl(_SET_PDEATHSIG, signal.SIGTERM)  # ends the command if the guard itself is killed
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)

    return subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True, preexec_fn=prepare)


def main(arguments: list[str]) -> int:
    """Run the command, and return its exit code, or 0 if the command was ended on request."""
    respawn, inside, grace = False, False, 5.0
    while arguments[0].startswith("--"):
        option = arguments.pop(0)
        respawn, inside = respawn or option == "--respawn", inside or option == "--inside"
        grace = float(arguments.pop(0)) if option == "--grace" else grace
    owner = os.getppid()
    os.setsid()  # Ctrl-C in the owner's terminal is handled by the owner
    ctypes.CDLL(None, use_errno=True).prctl(_SET_CHILD_SUBREAPER, 1)
    signal_pipe, wake = os.pipe()
    os.set_blocking(wake, False)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGCHLD):
        signal.signal(number, lambda number, _: os.write(wake, b"c" if number == signal.SIGCHLD else b"!"))
    child = _start(arguments)
    while True:
        ready, _, _ = select.select([0, signal_pipe], [], [], _LOOK)
        # A fork of the owner may keep the pipe open, so also check whether the owner has ended.
        if 0 in ready or os.getppid() != owner or (signal_pipe in ready and b"!" in os.read(signal_pipe, 4096)):
            _end(child, grace, inside)
            return 0
        code = child.poll()
        _reap_adopted(child.pid)
        if code is not None and respawn:
            time.sleep(_RESPAWN_PAUSE)
            child = _start(arguments)
        elif code is not None:
            _end(child, grace, inside)  # a killed launcher may leave processes behind
            return code if code >= 0 else 128 - code


def _reap_adopted(child: int) -> None:
    """Reap orphaned child processes that have ended, but not the command itself, whose exit code is still needed."""
    with open(f"/proc/self/task/{os.getpid()}/children") as file:
        adopted = [pid for pid in map(int, file.read().split()) if pid != child]
    for pid in adopted:
        with contextlib.suppress(ChildProcessError):
            os.waitpid(pid, os.WNOHANG)


if __name__ == "__main__":
    returncode = main(sys.argv[1:])
    _reap()
    sys.exit(returncode)
