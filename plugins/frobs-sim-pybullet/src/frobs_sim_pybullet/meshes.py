"""Writes robot meshes to files for Bullet, which supports few formats and silently accepts broken files."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import TypeAlias

import numpy as np

from frobs_core.models import Mesh
from frobs_models import MeshPart, convex_parts, read_mesh, scaled, write_stl

Rgba: TypeAlias = tuple[float, float, float, float]


class MeshFiles:
    """Writes each mesh once, in meters, to a temporary folder, which :meth:`clear` removes."""

    def __init__(self) -> None:
        self._folder: Path | None = None
        self._hulls: dict[Mesh, list[Path]] = {}
        self._drawn: dict[Mesh, list[tuple[Path, Rgba | None]]] = {}

    def hulls(self, mesh: Mesh) -> list[Path]:
        """Return files with the points of each convex piece of a mesh, or of the whole mesh if it is not decomposed.

        Bullet uses the convex hull of the points in each file.
        """
        if mesh not in self._hulls:
            files = []
            for number, piece in enumerate(convex_parts(mesh)):
                points = np.unique(piece.vertices, axis=0)
                # The triangles contain each point at least once, which is enough for a convex hull.
                corners = np.arange(-(-len(points) // 3) * 3) % len(points)
                part = MeshPart(points, corners.reshape(-1, 3).astype(np.int32))
                files.append(self._write(part, f"hull_{len(self._hulls)}_{number}"))
            self._hulls[mesh] = files
        return self._hulls[mesh]

    def drawn(self, mesh: Mesh) -> list[tuple[Path, Rgba | None]]:
        """Return a file and a color for each single-color part of a mesh."""
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
        """Remove all files. Meshes that are requested later are written again."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None
        self._hulls.clear()
        self._drawn.clear()
