"""Adds meshes to a MuJoCo model as triangles instead of files, so that all file formats are handled in the same way."""

from __future__ import annotations

import mujoco
import numpy as np

from frobs_core.models import Mesh
from frobs_models import MeshPart, Rgba, convex_parts, read_mesh, scaled

_LEAST_VERTICES = 4  # minimum number that MuJoCo accepts

Use = tuple[str, Rgba | None]
"""Name and color of a mesh in the specification."""


class Meshes:
    """Adds each mesh to a specification once, even if several geoms use it.

    Args:
        spec: Specification to which the meshes are added.
    """

    def __init__(self, spec: mujoco.MjSpec) -> None:
        self._spec = spec
        self._known = {mesh.name for mesh in spec.meshes}
        self._hulls: dict[Mesh, list[Use]] = {}

    def hull(self, mesh: Mesh) -> list[Use]:
        """Return the collision meshes of a mesh: the whole mesh, or its convex pieces if it is decomposed.

        MuJoCo uses the convex hulls of the returned meshes for collisions, but casts rays against the triangles.

        Raises:
            ModelFileError: The file cannot be read.
            MissingDependencyError: The package for decomposing meshes is not installed.
        """
        if mesh not in self._hulls:
            name = f"{mesh.path}{mesh.scale}"
            parts = convex_parts(mesh)
            names = [f"{name}convex{number}" if mesh.decomposed else name for number in range(len(parts))]
            for name, part in zip(names, parts, strict=True):
                if name not in self._known:
                    self._add(name, part)
            self._hulls[mesh] = [(name, None) for name in names]
        return self._hulls[mesh]

    def drawn(self, mesh: Mesh) -> list[Use]:
        """Return the name and the color of each single-color part of a mesh, for rendering.

        Raises:
            ModelFileError: The file cannot be read.
        """
        uses = []
        for number, part in enumerate(scaled(read_mesh(mesh.path), mesh.scale)):
            name = f"{mesh.path}{mesh.scale}#{number}"
            if name not in self._known:
                self._add(name, part)
            uses.append((name, part.rgba))
        return uses

    def _add(self, name: str, part: MeshPart) -> None:
        element = self._spec.add_mesh(name=name)
        missing = max(0, _LEAST_VERTICES - len(part.vertices))  # MuJoCo rejects single triangles unless they are padded
        element.uservert = np.pad(part.vertices, ((0, missing), (0, 0)), "edge").astype("f4").ravel()
        element.userface = part.faces.ravel()
        element.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # the mesh adds no mass, so it need not be closed
        self._known.add(name)
