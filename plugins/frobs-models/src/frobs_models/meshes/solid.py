"""Volume and inertia of closed meshes."""

from __future__ import annotations

import numpy as np

from frobs_core.models import Mesh
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_models.meshes.mesh import joined, read_mesh, scaled


def mesh_solid(mesh: Mesh) -> tuple[float, Floats, Floats]:
    """Return the volume [m³], the centroid (3,) [m], and the inertia about it for a mass of 1 kg, (3, 3) [m²]."""
    import trimesh

    part = joined(scaled(read_mesh(mesh.path), mesh.scale))
    solid = trimesh.Trimesh(part.vertices, part.faces)
    if not solid.is_volume:
        raise ModelFileError(
            mesh.path,
            "the surface of the mesh is not closed, so its volume is unknown; "
            "set the body's mass, center_of_mass and inertia.",
        )
    volume = float(solid.volume)
    return volume, np.asarray(solid.center_mass, float), np.asarray(solid.moment_inertia, float) / volume
