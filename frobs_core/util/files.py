"""Size-limited reading and atomic writing of files, and the location of the cache folder.

Untrusted files are opened only if they are regular files within a size limit.
"""

from __future__ import annotations

import errno
import json
import os
import secrets
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from frobs_core.util.budgets import BUDGETS
from frobs_core.util.plain import to_json

_KINDS = {
    stat.S_IFIFO: "a FIFO",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a folder",
}

_HOMELESS = Path("/nonexistent")  # path that Debian assigns to users without a home folder; it does not exist


class UnsuitableFileError(OSError):
    """The file exists but is not a regular file, exceeds a limit, or is damaged. ``strerror`` contains the reason."""


def read_limited(path: Path | str, limit: int) -> bytes:
    """Read a regular file. Symbolic links are followed.

    FIFOs and devices are not opened, because reading from them could block or never end.

    Args:
        path: The file.
        limit: Maximum size [bytes].

    Raises:
        UnsuitableFileError: The file is not a regular file or exceeds ``limit``. The message contains the limit.
        OSError: The file cannot be read.
    """
    check_regular(path, limit)
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(descriptor, "rb") as file:
        _check(os.fstat(descriptor), path, limit)  # the file may have been replaced in the meantime
        data = file.read(limit + 1)
    if len(data) > limit:  # files in /proc do not report their size
        raise _too_large(path, limit)
    return data


def read_json(path: Path | str) -> dict[str, Any]:
    """Read a JSON object from ``path``, a file of a run folder.

    Returns:
        The object. Its values may have any type, because the file may have been changed.

    Raises:
        UnsuitableFileError: The file is not a regular file, exceeds a limit, or does not contain a JSON object.
        OSError: The file cannot be read.
    """
    limits = BUDGETS["run folder"]
    deepest = limits["levels of nesting in a JSON file"]
    try:
        found = json.loads(read_limited(path, limits["bytes of a JSON file"]).decode("utf-8"))
        reason = None if isinstance(found, dict) else f"it contains a {type(found).__name__} instead of a JSON object"
        level, depth = [found], 0
        while reason is None and level:
            depth += 1
            if depth > deepest:
                reason = f"it has more than {deepest} levels of nesting"
            inner = [value.values() if isinstance(value, dict) else value for value in level]
            level = [item for values in inner for item in values if isinstance(item, dict | list)]
    except UnicodeDecodeError:
        reason = "it is not UTF-8 text"
    except json.JSONDecodeError as error:
        reason = f"it is not valid JSON: {error}"
    except RecursionError:
        reason = f"it has more than {deepest} levels of nesting"
    except ValueError:  # Python limits the number of digits, because converting them takes quadratic time
        reason = "an integer has too many digits"
    if reason is not None:
        raise UnsuitableFileError(errno.EINVAL, reason, os.fspath(path))
    return cast("dict[str, Any]", found)


def check_regular(path: Path | str, limit: int) -> int:
    """Check the file ``path`` as :func:`read_limited` does, but without opening it.

    Returns:
        The file size [bytes].

    Raises:
        UnsuitableFileError: The file is not a regular file or exceeds ``limit``.
        OSError: The file does not exist, or its folder cannot be accessed.
    """
    try:
        found = os.stat(path)
    except ValueError as error:  # a NUL character in the path
        raise OSError(errno.EINVAL, str(error), os.fspath(path)) from error
    _check(found, path, limit)
    return found.st_size


def _check(found: os.stat_result, path: Path | str, limit: int) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "a special file")
        raise UnsuitableFileError(errno.EINVAL, f"it is {kind}, not a regular file", os.fspath(path))
    if found.st_size > limit:
        raise _too_large(path, limit)


def _too_large(path: Path | str, limit: int) -> UnsuitableFileError:
    size = f"{limit // 2**20} MiB" if limit >= 2**20 else f"{limit // 2**10} KiB"
    return UnsuitableFileError(errno.EFBIG, f"the file exceeds the size limit of {size}", os.fspath(path))


def write_aside(path: Path, write: Callable[[Path], object], *, durable: bool = True) -> None:
    """Write a file under a temporary name and rename it, so that other processes never see a partial file.

    Args:
        path: The file. An existing file is replaced, and missing folders are created.
        write: Function that writes the file. The function receives a temporary path in the same folder, with the same
            suffix.
        durable: Whether to flush the file to disk, so that it survives a power failure. Caches do not need to be
            flushed.

    Raises:
        OSError: The file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.stem}.{secrets.token_hex(8)}{path.suffix}")
    try:
        write(aside)
        if durable:
            sync(aside)
        os.replace(aside, path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise
    if durable:
        sync(path.parent)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text atomically."""
    write_aside(path, lambda aside: aside.write_text(text, encoding="utf-8"))


def write_json(path: Path, value: Any) -> None:
    """Write JSON atomically, see :func:`frobs_core.util.plain.to_json`."""
    write_text(path, to_json(value, indent=2) + "\n")


def sync(path: Path) -> None:
    """Flush a file or folder to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def cache_folder(*names: str) -> Path:
    """Return the path of a folder in the cache.

    The cache is the folder ``frobs`` in ``$XDG_CACHE_HOME``, or in ``~/.cache`` if the variable is unset or a relative
    path.

    Args:
        *names: Names of the nested folders.

    Returns:
        The path. The folder may not exist yet, and creating it may fail.
    """
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not base.is_absolute():
        try:
            base = Path.home() / ".cache"
        except RuntimeError:  # neither $HOME nor a user database entry exists
            base = _HOMELESS / ".cache"
    return base.joinpath("frobs", *names)
