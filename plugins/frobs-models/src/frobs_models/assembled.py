"""Writes model files and meshes that FRobs assembles to the cache, under names derived from their content."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from frobs_core.util.files import cache_folder, write_aside, write_text
from frobs_models.meshes.mesh import MeshPart, write_stl

_FOLDER = "assembled"
_LONGEST = 50  # number of characters of a title in a file name


def write_model(title: str, text: str) -> Path:
    """Write the text of a model file and return its path. The title, which comes from a file, may be any text."""
    name = re.sub(r"[^\w.-]+", "_", title)[:_LONGEST]
    path = cache_folder(_FOLDER) / f"{name}-{_digest(text.encode())}.urdf"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
    return path


def write_part(part: MeshPart) -> Path:
    """Write triangles as a binary STL file and return its path."""
    path = cache_folder(_FOLDER) / f"{_digest(part.vertices.tobytes() + part.faces.tobytes())}.stl"
    if not path.exists():
        write_aside(path, lambda aside: write_stl(part, aside), durable=False)
    return path


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]
