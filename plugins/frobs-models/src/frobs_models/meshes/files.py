"""Reads mesh files and the files that they refer to, such as buffers, materials and textures."""

from __future__ import annotations

import base64
import os
from pathlib import Path

from frobs_core.util.errors import ModelFileError
from frobs_core.util.files import UnsuitableFileError, check_regular, read_limited
from frobs_models.budgets import BUDGETS

MAX_BYTES = BUDGETS["mesh"]["bytes with the files that it names"]
"""Maximum size of a mesh file, and maximum total size of the files that it refers to [bytes]."""

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg=="
)
"""A one-pixel PNG file that replaces every texture. Textures are not rendered, and a small file may contain a huge
texture.
"""

_TEXTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".gif", ".webp", ".dds", ".ktx2")


class SiblingFiles:
    """Trimesh resolver for the files that a mesh refers to.

    These files must be in the mesh file's folder or below it.

    Attributes:
        file_name: Name of the mesh file.
        refused: Reason why a file that the mesh refers to was rejected, or None if no file was rejected. A missing file
            is not rejected.
    """

    def __init__(self, mesh: Path) -> None:
        self.file_name = mesh.name
        self.refused: str | None = None
        self._folder = mesh.parent.resolve()
        self._left = MAX_BYTES

    def get(self, name: str) -> bytes:
        """Return a file's content.

        Raises:
            FileNotFoundError: The file is missing or outside the mesh file's folder.
            OSError: The file is not a regular file, or the total size exceeds :data:`MAX_BYTES`.
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
                self.refused = f"the mesh refers to '{name}', but {error.strerror}."
                raise
            self._left -= len(data)
            return data
        raise FileNotFoundError(name)

    __getitem__ = get


def read_mesh_file(path: Path) -> bytes:
    """Return a mesh file's content."""
    try:
        return read_limited(path, MAX_BYTES)
    except UnsuitableFileError as error:
        raise ModelFileError(
            path, f"the mesh cannot be read: {error.strerror}. Simplify the mesh or use another one."
        ) from error
    except OSError as error:
        raise ModelFileError(path, f"the mesh cannot be read: {error.strerror or error}.") from error
