"""Writes the convex hulls of meshes to a folder that Gazebo's programs can read."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from frobs_core.models import Mesh
from frobs_core.util.errors import ModelFileError
from frobs_models import MeshPart, convex_parts, write_stl
from frobs_sim_gazebo.installation import Installation


class MeshFiles:
    """Writes each mesh's convex hull once, to a file whose name is a hash of the hull.

    Args:
        installation: Installation whose programs read the meshes, or None to check the meshes without writing them.
    """

    def __init__(self, installation: Installation | None) -> None:
        self._installation = installation
        self._hulls: dict[Mesh, list[str]] = {}

    def hulls(self, mesh: Mesh) -> list[str]:
        """Return the URI of a mesh's convex hull in meters, or one URI per convex piece of a decomposed mesh.

        The other simulators use the same convex shapes, which allow fast collision checks.

        Raises:
            ModelFileError: The mesh cannot be read, or is flat.
            MissingDependencyError: The package for decomposing meshes is not installed.
        """
        if mesh not in self._hulls:
            self._hulls[mesh] = [self._store(_hull(mesh, piece)) for piece in convex_parts(mesh)]
        return self._hulls[mesh]

    def _store(self, part: MeshPart) -> str:
        if self._installation is None:
            return ""
        key = hashlib.sha256(part.vertices.tobytes() + part.faces.tobytes()).hexdigest()[:32]

        def write(aside: Path) -> None:
            write_stl(part, aside)
            aside.chmod(0o644)  # regardless of the umask

        return f"file://{self._installation.add_file(f'meshes/{key}.stl', write)}"


def _hull(mesh: Mesh, piece: MeshPart) -> MeshPart:
    points = np.unique(piece.vertices, axis=0)
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise ModelFileError(mesh.path, "the mesh is flat, but collision shapes must have a volume.") from error
    faces = hull.simplices.astype(np.int32)
    corners = points[faces]
    inward = (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * hull.equations[:, :3]).sum(-1)
    faces[inward < 0.0] = faces[inward < 0.0][:, ::-1]
    return MeshPart(points, faces)
