"""Stores the generated message packages in the user's cache."""

from __future__ import annotations

import atexit
import hashlib
import shutil
import tempfile
import threading
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path

from frobs_core.files import cache_folder, write_aside
from frobs_ros.environment import make_findable
from frobs_ros.errors import RosError, RosNotFoundError
from frobs_ros.log import LOG
from frobs_ros.messages.generator import generate

DEFINITIONS = Path(__file__).with_name("definitions")

_DIGEST = "sha256"  # the file with the digest of all others; it is written last
_lock = threading.RLock()  # genpy keeps its state in module variables
_temporary: dict[Path, Path] = {}  # by the folder that cannot be written


def message_folder() -> Path:
    """Return the folder of the generated message packages, and generate them unless the cache contains them.

    The folder's name is a digest of the definitions and of the generator's source code. Several processes may call this
    at once: they write the same files, and each file appears complete. Damaged files are generated again. If the cache
    cannot be written, the packages are generated in a temporary folder that is deleted when this process exits.

    Raises:
        RosNotFoundError: genpy, genmsg or a message package that the definitions refer to is not installed.
        RosError: Neither the cache nor a temporary folder can be written.
    """
    make_findable()
    folder = cache_folder("messages", _key())
    with _lock:
        if folder in _temporary:
            return _temporary[folder]
        if not _is_complete(folder):
            files = generate(DEFINITIONS)
            try:
                _store(files, folder)
            except OSError as error:
                return _store_temporarily(files, folder, error)
    return folder


def _key() -> str:
    """Return a digest of all that determines the generated code."""
    sources = [Path(__file__).with_name("generator.py"), *DEFINITIONS.rglob("*.*")]
    for module in ("genpy", "genmsg"):
        spec = find_spec(module)
        if spec is None or spec.origin is None:
            raise RosNotFoundError(f"no module '{module}' is installed on this machine", (f"python3-{module}",))
        sources += Path(spec.origin).parent.glob("*.py")
    # The last three parts of a path: package, kind and name of a definition.
    return _digest((path.relative_to(path.parents[2]).as_posix(), path.read_bytes()) for path in sources)[:16]


def _digest(files: Iterable[tuple[str, bytes]]) -> str:
    digest = hashlib.sha256()
    for name, content in sorted(files):
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def _is_complete(folder: Path) -> bool:
    """Return whether a folder contains exactly the files that were generated into it."""
    try:
        stored = (folder / _DIGEST).read_text("utf-8")
        return stored == _digest((str(path.relative_to(folder)), path.read_bytes()) for path in folder.rglob("*.py"))
    except (OSError, ValueError):
        return False


def _store(files: Mapping[str, str], folder: Path) -> None:
    """Write the generated files, and the digest last."""
    contents = {name: code.encode() for name, code in files.items()}
    for path in folder.rglob("*.py"):
        if str(path.relative_to(folder)) not in contents:
            path.unlink()
    for name, content in [*contents.items(), (_DIGEST, _digest(contents.items()).encode())]:
        path = folder / name
        if not path.is_file() or path.read_bytes() != content:
            write_aside(path, lambda aside, content=content: aside.write_bytes(content), durable=False)


def _store_temporarily(files: Mapping[str, str], folder: Path, reason: OSError) -> Path:
    """Write the generated files to a new temporary folder, and log why."""
    try:
        temporary = Path(tempfile.mkdtemp(prefix="frobs-messages-"))
        atexit.register(shutil.rmtree, temporary, ignore_errors=True)
        _store(files, temporary)
    except OSError as error:
        raise RosError(
            f"the ROS message packages cannot be stored: neither in {folder} ({reason}) nor in a temporary folder "
            f"({error}). Set XDG_CACHE_HOME to a folder that you can write to."
        ) from error
    LOG.warning(
        "The ROS message packages cannot be stored in %s (%s). This process uses %s instead, and every process "
        "generates them again. Set XDG_CACHE_HOME to a folder that you can write to.",
        folder, reason, temporary,
    )  # fmt: skip
    _temporary[folder] = temporary
    return temporary
