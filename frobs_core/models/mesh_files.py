"""A mesh file's bytes, and those of the files beside it that it names: buffers, materials and textures."""

from __future__ import annotations

import base64
import os
from pathlib import Path

from frobs_core.errors import ModelFileError
from frobs_core.files import UnsuitableFileError, check_regular, read_limited

MAX_BYTES = 256 * 2**20
"""Largest mesh file, and the most that the files have together that it names [bytes]."""

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg=="
)
"""A PNG file of one pixel, which takes the place of every texture: nobody draws them, and a small file may hold a huge
one."""

_TEXTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".gif", ".webp", ".dds", ".ktx2")


class SiblingFiles:
    """Reads what a mesh file names, for trimesh: only from its own folder and those below.

    Args:
        mesh: The mesh file.

    Attributes:
        file_name: Name of the mesh file.
        refused: Why a file that it names cannot be used; None: each was found suitable or is missing.
    """

    def __init__(self, mesh: Path) -> None:
        self.file_name = mesh.name
        self.refused: str | None = None
        self._folder = mesh.parent.resolve()
        self._left = MAX_BYTES

    def get(self, name: str) -> bytes:
        """Return a file's bytes.

        Raises:
            FileNotFoundError: It is missing, or in another folder.
            OSError: It is not a regular file, or the files have together more than :data:`MAX_BYTES`.
        """
        name = name.strip()
        for candidate in (name, name.lstrip("/"), os.path.basename(name)):
            path = (self._folder / candidate).resolve()
            if not path.is_relative_to(self._folder) or not os.path.exists(path):
                continue
            try:
                if path.suffix.lower() in _TEXTURES:
                    check_regular(path, MAX_BYTES)
                    return PIXEL
                data = read_limited(path, self._left)
            except UnsuitableFileError as error:
                self.refused = f"the mesh names '{name}', and {error.strerror}."
                raise
            self._left -= len(data)
            return data
        raise FileNotFoundError(name)

    __getitem__ = get


def read_mesh_file(path: Path) -> bytes:
    """Return a mesh file's bytes.

    Raises:
        ModelFileError: It cannot be read, is not a regular file, or has more than :data:`MAX_BYTES`.
    """
    try:
        return read_limited(path, MAX_BYTES)
    except UnsuitableFileError as error:
        raise ModelFileError(
            path, f"the mesh cannot be read: {error.strerror}. Simplify it or name another."
        ) from error
    except OSError as error:
        raise ModelFileError(path, f"the mesh cannot be read: {error.strerror or error}.") from error
