"""Watches a command from inside its process: records writes outside its folders, executed code and network access.

The hook sees what Python does. Files that native code writes are found by comparing folders afterwards
(:meth:`server.Server.run`).
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
PATHS = {  # by audit event: indices of the paths that change, and of the folder descriptors that they are relative to
    "os.mkdir": ((0, 2),),
    "os.remove": ((0, 1),),
    "os.rmdir": ((0, 1),),
    "os.rename": ((0, 2), (1, 3)),
    "os.symlink": ((1, 2),),
    "os.link": ((1, 3),),
    "os.chmod": ((0, 2),),
    "os.chown": ((0, 3),),
    "os.utime": ((0, 3),),
    "os.mkfifo": ((0, None),),
}
FOLLOWED = {"os.truncate": 0, "sqlite3.connect": 0}
"""Audit events that change the file to which a link leads, and the index of the path."""

PROGRAMS = {"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn"}
NETWORK = {
    "socket.getaddrinfo": 0,
    "urllib.Request": 0,
    "http.client.connect": 1,
    "ftplib.connect": 1,
    "smtplib.connect": 1,
}
"""Audit events that reach another machine, and the index of its name."""


def install(folder: Path, writable: Sequence[Path], report: int) -> None:
    """Write one line of JSON, ``[what, detail]``, for each suspicious action of this process.

    Args:
        folder: Folder of the case. Code from a file in it must not be executed.
        writable: Folders in which files may be changed.
        report: File descriptor to write to.
    """
    inputs = os.path.realpath(folder)
    allowed = tuple(os.path.realpath(path) for path in writable)
    devices = ("/dev/null", "/dev/shm/", "/dev/tty")

    def tell(what: str, detail: object) -> None:
        os.write(report, json.dumps([what, str(detail)[:300]]).encode() + b"\n")

    def check_write(path: Any, descriptor: Any = None, *, follow: bool = False) -> None:
        if isinstance(path, int) or path is None:
            return
        text = os.fsdecode(path)
        if text in (":memory:", "") or text.startswith("file:"):
            return
        if isinstance(descriptor, int) and descriptor >= 0 and not os.path.isabs(text):
            text = os.path.join(os.readlink(f"/proc/self/fd/{descriptor}"), text)
        try:
            head, tail = os.path.split(text)
            real = os.path.realpath(text) if follow else os.path.join(os.path.realpath(head or "."), tail)
        except ValueError:  # a NUL character, which the operating system rejects
            return
        if not any(real == root or real.startswith(f"{root}/") for root in allowed) and not real.startswith(devices):
            tell("write", real)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            if arguments[2] & WRITES:
                check_write(arguments[0], follow=True)
        elif event in PATHS:
            for path, descriptor in PATHS[event]:
                check_write(arguments[path], None if descriptor is None else arguments[descriptor])
        elif event in FOLLOWED:
            check_write(arguments[FOLLOWED[event]], follow=True)
        elif event in PROGRAMS:
            tell("program", arguments[0] if event == "os.system" else arguments[:2])
        elif event == "pickle.find_class":
            tell("pickle", ".".join(map(str, arguments)))
        elif event == "exec":
            file = getattr(arguments[0], "co_filename", "")
            if not file.startswith("<") and os.path.realpath(file).startswith(f"{inputs}/"):
                tell("code", file)
        elif event in NETWORK or (event == "socket.connect" and isinstance(arguments[1], tuple)):
            host = arguments[1][0] if event == "socket.connect" else arguments[NETWORK[event]]
            if host not in ("127.0.0.1", "localhost", "::1", None):
                tell("network", host)

    sys.addaudithook(hook)
