"""Opening files that somebody else may have written: regular files of a limited size, and nothing else."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

MAX_TEXT_BYTES = 16 * 2**20
"""Largest model file (URDF, xacro, MJCF) [bytes]."""

_KINDS = {
    stat.S_IFIFO: "a FIFO",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a folder",
}


class UnsuitableFileError(OSError):
    """The file exists, and is not a regular file or exceeds the size limit; ``strerror`` says which."""


def read_limited(path: Path | str, limit: int) -> bytes:
    """Read a regular file; links to one are followed.

    A FIFO or a device could block forever or never end, so neither is opened.

    Args:
        path: The file.
        limit: Largest size [bytes].

    Raises:
        UnsuitableFileError: It is not a regular file, or larger than ``limit``; the message names the limit.
        OSError: It cannot be read.
    """
    check_regular(path, limit)
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(descriptor, "rb") as file:
        _check(os.fstat(descriptor), path, limit)  # it may have been replaced
        data = file.read(limit + 1)
    if len(data) > limit:  # files of /proc tell no size
        raise _too_large(path, limit)
    return data


def check_regular(path: Path | str, limit: int) -> int:
    """Check a file as :func:`read_limited` does, without opening it.

    Returns:
        Its size [bytes].

    Raises:
        UnsuitableFileError: It is not a regular file, or larger than ``limit``.
        OSError: It does not exist, or its folder cannot be searched.
    """
    try:
        found = os.stat(path)
    except ValueError as error:  # a NUL character in the path
        raise OSError(errno.EINVAL, str(error), os.fspath(path)) from error
    _check(found, path, limit)
    return found.st_size


def _check(found: os.stat_result, path: Path | str, limit: int) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "special")
        raise UnsuitableFileError(errno.EINVAL, f"it is {kind}, and only regular files are opened", os.fspath(path))
    if found.st_size > limit:
        raise _too_large(path, limit)


def _too_large(path: Path | str, limit: int) -> UnsuitableFileError:
    size = f"{limit // 2**20} MiB" if limit >= 2**20 else f"{limit // 2**10} KiB"
    return UnsuitableFileError(errno.EFBIG, f"it is larger than {size}, the limit for such files", os.fspath(path))
