"""The meshes of robots in files that Bullet reads: it knows few formats, and takes what is broken in silence."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import TypeAlias

import numpy as np

from frobs_core.models import Mesh, MeshPart, convex_parts, read_mesh, scaled, write_stl

Rgba: TypeAlias = tuple[float, float, float, float]


class MeshFiles:
    """Writes each mesh once, in metres, into a folder of its own, and takes the folder away again."""

    def __init__(self) -> None:
        self._folder: Path | None = None
        self._hulls: dict[Mesh, list[Path]] = {}
        self._drawn: dict[Mesh, list[tuple[Path, Rgba | None]]] = {}

    def hulls(self, mesh: Mesh) -> list[Path]:
        """Return a file of a mesh's points, or of each of its convex pieces; Bullet takes their convex hull.

        Raises:
            ModelFileError: The mesh cannot be read.
            MissingDependencyError: The mesh cannot be decomposed here.
        """
        if mesh not in self._hulls:
            files = []
            for number, piece in enumerate(convex_parts(mesh)):
                points = np.unique(piece.vertices, axis=0)
                corners = np.arange(-(-len(points) // 3) * 3) % len(points)  # each point once: all that a hull needs
                part = MeshPart(points, corners.reshape(-1, 3).astype(np.int32))
                files.append(self._write(part, f"hull_{len(self._hulls)}_{number}"))
            self._hulls[mesh] = files
        return self._hulls[mesh]

    def drawn(self, mesh: Mesh) -> list[tuple[Path, Rgba | None]]:
        """Return a file for each of a mesh's colours, with the colour.

        Raises:
            ModelFileError: The mesh cannot be read.
        """
        if mesh not in self._drawn:
            self._drawn[mesh] = [
                (self._write(part, f"drawn_{len(self._drawn)}_{number}"), part.rgba)
                for number, part in enumerate(scaled(read_mesh(mesh.path), mesh.scale))
            ]
        return self._drawn[mesh]

    def _write(self, part: MeshPart, name: str) -> Path:
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="frobs-"))
        path = self._folder / f"{name}.stl"
        write_stl(part, path)
        return path

    def clear(self) -> None:
        """Remove the files; what is asked for later is written anew."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None
        self._hulls.clear()
        self._drawn.clear()
