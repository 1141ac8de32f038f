"""Cache of parsed meshes on disk, keyed by file content. Several processes may use the cache concurrently."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np

from frobs_core.util.files import cache_folder, read_limited, write_aside
from frobs_models.meshes.files import MAX_BYTES

_VERSION = b"2"  # version of the parser, which is part of the key
_MATERIALS = re.compile(rb"^[ \t]*mtllib[ \t]+(.*)$", re.MULTILINE)
_MAX_NAMES = 1_000  # maximum number of referenced files that the key covers
_BUFFERS = re.compile(rb'"uri"\s*:\s*"(?!data:)([^"]+)"')


class _Part(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...
    @property
    def rgba(self) -> Any: ...


P = TypeVar("P", bound=_Part)


class MeshCache:
    """Cache entry of one mesh.

    The key depends on the mesh file's bytes and suffix, and on the files that the mesh refers to, such as the materials
    of an OBJ file or the buffers of a glTF file. If the cache cannot be read or written, the mesh is parsed again each
    time.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        suffix = path.suffix.lower()
        key = hashlib.sha256(_VERSION + suffix.encode() + b"\0" + data)
        pattern = {".obj": _MATERIALS, ".gltf": _BUFFERS}.get(suffix)
        left = MAX_BYTES
        for name in list(dict.fromkeys(pattern.findall(data)))[:_MAX_NAMES] if pattern else ():
            with contextlib.suppress(OSError, ValueError):
                beside = read_limited(path.parent / os.fsdecode(name.strip()), left)
                left -= len(beside)
                key.update(b"\0" + beside)
        self.file = cache_folder("meshes") / f"{key.hexdigest()}.npz"

    def load(self, part: Callable[[Any, Any, Any], P]) -> tuple[P, ...] | None:
        """Return the stored parts, or None if they do not exist or are damaged."""
        try:
            with self.file.open("rb") as file, np.load(file, allow_pickle=False) as stored:
                colours = stored["rgba"]  # (k, 4), NaN for parts without a color
                return tuple(
                    part(
                        stored[f"vertices{i}"],
                        stored[f"faces{i}"],
                        None if np.isnan(colour[0]) else tuple(colour.tolist()),
                    )
                    for i, colour in enumerate(colours)
                )
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None

    def store(self, parts: Iterable[_Part]) -> None:
        """Write parts atomically, so that a reader never sees incomplete data."""
        arrays: dict[str, Any] = {}
        colours = []
        for i, part in enumerate(parts):
            arrays |= {f"vertices{i}": part.vertices, f"faces{i}": part.faces}
            colours.append([np.nan] * 4 if part.rgba is None else part.rgba)

        def write(aside: Path) -> None:
            with aside.open("wb") as file:
                np.savez(file, rgba=np.array(colours, float), **arrays)

        with contextlib.suppress(OSError):
            write_aside(self.file, write, durable=False)
