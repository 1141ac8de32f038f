"""Lock that gives one process exclusive access to a run folder.

The operating system releases the lock when the process ends.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
from pathlib import Path
from typing import Self

from frobs_core.util.errors import RunError
from frobs_core.util.plain import to_json
from frobs_train.errors import RunBusyError

NAME = ".lock"
"""Name of the locked file in the run folder. The file identifies the process that holds the lock."""

_UNSUPPORTED = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)

_NO_LINKS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)  # a link could lead out of the run folder


class RunLock:
    """Context manager that locks a run folder for this process.

    Without support for locks, the folder is locked while the process identified in the lock file is running.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._descriptor: int | None = None

    def __enter__(self) -> Self:
        while not self._acquire():
            pass
        return self

    def _acquire(self) -> bool:
        """Lock the file, and return whether it is still the file of this folder.

        Between opening and locking the file, the process that held the lock may have replaced the folder.
        """
        try:
            descriptor = os.open(self._path / NAME, os.O_RDWR | os.O_CREAT | _NO_LINKS, 0o644)
        except OSError as error:
            raise RunError(
                f"the run folder {self._path} cannot be written: {error.strerror}; "
                "make the folder writable, or copy the run to a writable folder."
            ) from error
        try:
            holder = _read(descriptor)
            locked = _lock(descriptor)
            if not (not _alive(holder) if locked is None else locked):
                raise RunBusyError(self._path, *holder)
            if not _is_at(descriptor, self._path / NAME):
                os.close(descriptor)
                return False
            # The lock works even if a full disk prevents writing the process ID.
            with contextlib.suppress(OSError):
                os.ftruncate(descriptor, 0)
                os.pwrite(descriptor, to_json({"pid": os.getpid(), "host": socket.gethostname()}).encode(), 0)
        except BaseException:
            os.close(descriptor)
            raise
        self._descriptor = descriptor
        return True

    def __exit__(self, *error: object) -> None:
        """Release the lock. The file is kept, because another process may already have locked it."""
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, 0)
            os.close(self._descriptor)
            self._descriptor = None


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except FileNotFoundError:
        return False


def _lock(descriptor: int) -> bool | None:
    """Lock a file, and return whether no other process has locked it. Return None if locks are not supported."""
    try:
        import fcntl
    except ImportError:  # not POSIX
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno in _UNSUPPORTED:
            return None
        raise
    return True


def _read(descriptor: int) -> tuple[int | None, str | None]:
    try:
        holder = json.loads(os.pread(descriptor, 4096, 0) or b"{}")
        return int(holder["pid"]), str(holder["host"])
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None, None


def _alive(holder: tuple[int | None, str | None]) -> bool:
    """Return whether a process is running. Processes on other machines are assumed to be running."""
    pid, host = holder
    if pid is None or pid == os.getpid():
        return False
    if host != socket.gethostname():
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True
