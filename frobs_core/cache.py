"""The user's cache: files that FRobs derives from others, and that can be deleted at any time."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from pathlib import Path

_HOMELESS = Path("/nonexistent")  # Debian's home of users without one: nothing can be stored there


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


def write_aside(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file under another name and rename it, so that other processes see the whole file or none.

    Args:
        path: The file. An existing file is replaced, and missing folders are created.
        write: Receives the temporary path in the same folder, and creates that file.

    Raises:
        OSError: The file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f"{path.name}.{secrets.token_hex(8)}.part")
    try:
        write(aside)
        os.replace(aside, path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise
