"""Stores the generated message packages in the user's cache."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterable, Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from frobs_core.util.files import cache_folder, write_aside
from frobs_ros.errors import RosError, RosNotFoundError
from frobs_ros.messages.generator import generate
from frobs_ros.ros.environment import link_modules
from frobs_ros.ros.overlay import delete_unused

DEFINITIONS = Path(__file__).with_name("definitions")

_DIGEST = "sha256"  # file with the digest of all other files; it is written last
_lock = threading.RLock()  # prevents concurrent use of genpy, which stores its state in module variables


def message_folder() -> Path:
    """Return the folder of the generated message packages, and generate the packages if they are not in the cache.

    The folder's name is a digest of the definitions and of the generator's source code. Several processes may call this
    function simultaneously, because they write identical files, and each file is written atomically. Damaged files are
    generated again.

    Raises:
        RosNotFoundError: genpy, genmsg or a message package that the definitions refer to is not installed.
        RosError: The cache cannot be written.
    """
    link_modules()
    folder = cache_folder("messages", _key())
    with _lock:
        if not _is_complete(folder):
            files = generate(DEFINITIONS)
            try:
                _store(files, folder)
            except OSError as error:
                raise RosError(
                    f"the ROS message packages cannot be stored in {folder}: {error.strerror}; "
                    "set XDG_CACHE_HOME to a writable folder."
                ) from error
    delete_unused(folder)
    return folder


def _key() -> str:
    """Return a digest of all files that determine the generated code."""
    sources = {"generator.py": Path(__file__).with_name("generator.py")}
    sources |= {path.relative_to(DEFINITIONS).as_posix(): path for path in DEFINITIONS.rglob("*.*")}
    for module in ("genpy", "genmsg"):
        spec = find_spec(module)
        if spec is None or spec.origin is None:
            raise RosNotFoundError(f"the Python module '{module}' is not installed", (f"python3-{module}",))
        sources |= {f"{module}/{path.name}": path for path in Path(spec.origin).parent.glob("*.py")}
    return _digest((name, path.read_bytes()) for name, path in sources.items())[:16]


def _digest(files: Iterable[tuple[str, bytes]]) -> str:
    digest = hashlib.sha256()
    for name, content in sorted(files):
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def _is_complete(folder: Path) -> bool:
    """Return whether a folder contains all generated files and no others, by comparing their digest."""
    try:
        stored = (folder / _DIGEST).read_text("utf-8")
        return stored == _digest((str(path.relative_to(folder)), path.read_bytes()) for path in _modules(folder))
    except (OSError, ValueError):
        return False


def _modules(folder: Path) -> list[Path]:
    """Return the Python files in a folder, except for files that another process is writing."""
    return [path for path in folder.rglob("*.py") if not path.name.startswith(".")]


def _store(files: Mapping[str, str], folder: Path) -> None:
    """Write the generated files, and then their digest."""
    contents = {name: code.encode() for name, code in files.items()}
    for path in _modules(folder):
        if str(path.relative_to(folder)) not in contents:
            path.unlink()
    for name, content in [*contents.items(), (_DIGEST, _digest(contents.items()).encode())]:
        path = folder / name
        if not path.is_file() or path.read_bytes() != content:
            write_aside(path, partial(Path.write_bytes, data=content), durable=False)
