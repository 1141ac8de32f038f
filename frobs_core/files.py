"""Files: written so that a kill at any moment leaves the old one or the new one, and the folder of the cache."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

_HOMELESS = Path("/nonexistent")  # Debian's home of users without one: nothing can be stored there


def write_aside(path: Path, write: Callable[[Path], object], *, durable: bool = True) -> None:
    """Write a file under another name and rename it, so that other processes see the whole file or none.

    Args:
        path: The file. An existing file is replaced, and missing folders are created.
        write: Receives a temporary path in the same folder, with the same suffix, and creates that file.
        durable: Whether the file must also survive a power failure. Caches need not.

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
    """Write UTF-8 text, aside and renamed."""
    write_aside(path, lambda aside: aside.write_text(text, encoding="utf-8"))


def write_json(path: Path, value: Any) -> None:
    """Write JSON, aside and renamed."""
    write_text(path, json.dumps(value, indent=2) + "\n")


def sync(path: Path) -> None:
    """Have a file or folder written to the disk before going on."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def cache_folder(*names: str) -> Path:
    """Return a folder of the cache: ``frobs`` in ``$XDG_CACHE_HOME``, or in ``~/.cache`` if that is unset or relative.

    Args:
        *names: Folders below it.

    Returns:
        The path. The folder may not exist yet, and it may be impossible to create it.
    """
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not base.is_absolute():
        try:
            base = Path.home() / ".cache"
        except RuntimeError:  # neither $HOME nor an entry for the user ID
            base = _HOMELESS / ".cache"
    return base.joinpath("frobs", *names)
