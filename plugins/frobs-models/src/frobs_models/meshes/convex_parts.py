"""Convex decomposition of collision meshes."""

from __future__ import annotations

import logging

import numpy as np

from frobs_core.models import Mesh
from frobs_core.util.errors import MissingDependencyError, ModelFileError
from frobs_models.budgets import BUDGETS
from frobs_models.meshes.cache import MeshCache
from frobs_models.meshes.mesh import MeshPart, joined, read_mesh, scaled

MAX_FACES = BUDGETS["mesh"]["triangles to decompose"]
"""Maximum number of triangles in a mesh to decompose. The decomposition of a larger mesh would take minutes."""

THICKNESS = 1e-3
"""Thickness of the plate that replaces a flat collision mesh [m]."""

FLAT = 1e-6
"""Extent of a flat mesh across its plane, relative to its largest extent."""

CONVEX = 0.95
"""Minimum volume of a nearly convex mesh, relative to its convex hull."""

_SETTINGS = {
    "threshold": 0.05,  # maximum concavity of a piece, relative to the size of the mesh
    "max_convex_hull": 64,  # maximum number of pieces
    "resolution": 1000,  # number of sample points for measuring the concavity
    "mcts_nodes": 10,  # half of CoACD's default, as for mcts_iterations, to halve the computation time
    "mcts_iterations": 60,
    "seed": 0,
}
_CACHED_AS = ".convex-parts-2"  # version of the settings, which is part of the cache key


def convex_parts(mesh: Mesh) -> tuple[MeshPart, ...]:
    """Return the parts whose convex hulls serve as collision shapes: decomposed pieces or the whole mesh.

    If the connected components of a mesh are convex, these components are the pieces. The pieces depend only on the
    file's content, so they are the same in every simulator. The pieces are cached.

    Raises:
        ModelFileError: The mesh cannot be read, or has too many triangles to be decomposed.
        MissingDependencyError: The mesh must be decomposed, but CoACD is not installed.
    """
    undivided = joined(read_mesh(mesh.path))
    if not mesh.decomposed:
        return tuple(_with_volume(mesh, part) for part in scaled([undivided], mesh.scale))
    cache = MeshCache(mesh.path.with_suffix(_CACHED_AS), undivided.vertices.tobytes() + undivided.faces.tobytes())
    parts = cache.load(MeshPart)
    if parts is None:
        parts = _convex_components(undivided) or _decompose(mesh, undivided)
        cache.store(parts)
    return tuple(_with_volume(mesh, part) for part in scaled(parts, mesh.scale))


def _with_volume(mesh: Mesh, part: MeshPart) -> MeshPart:
    """Make a plate of a flat mesh, because engines reject a collision shape without a volume."""
    points = part.vertices - part.vertices.mean(axis=0)
    _, axes = np.linalg.eigh(points.T @ points)  # (3,), (3, 3); the first axis is that of the smallest extent
    extents = np.ptp(points @ axes, axis=0)  # (3,) [m]
    if extents[0] > FLAT * extents[2]:
        return part
    if extents[1] <= FLAT * extents[2]:
        raise ModelFileError(mesh.path, "all vertices of the collision mesh lie on a line: replace it by a shape.")
    corners = part.vertices[part.faces]  # (m, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up = normals @ axes[:, 0] > 0.0
    top = np.where(up[:, None], part.faces, part.faces[:, ::-1])
    shift = 0.5 * THICKNESS * axes[:, 0]
    return MeshPart(
        np.concatenate([part.vertices + shift, part.vertices - shift]),
        np.concatenate([top, top[:, ::-1] + len(part.vertices)]).astype(np.int32),
    )


def _convex_components(undivided: MeshPart) -> tuple[MeshPart, ...]:
    """Return the connected components of a mesh, or nothing if one of them is not nearly convex."""
    import trimesh

    components = trimesh.Trimesh(undivided.vertices, undivided.faces).split(only_watertight=False)
    if len(components) > _SETTINGS["max_convex_hull"]:
        return ()
    if not all(each.is_volume and each.volume >= CONVEX * each.convex_hull.volume for each in components):
        return ()
    return tuple(MeshPart(np.array(each.vertices, float), np.array(each.faces, np.int32)) for each in components)


def _decompose(mesh: Mesh, undivided: MeshPart) -> tuple[MeshPart, ...]:
    if len(undivided.faces) > MAX_FACES:
        raise ModelFileError(
            mesh.path,
            f"the mesh has {len(undivided.faces):,} triangles; at most {MAX_FACES:,} can be decomposed. Simplify the mesh.",
        )
    try:
        import coacd
    except ImportError as error:
        purpose = f"the convex decomposition of {mesh.path}"
        raise MissingDependencyError(purpose, ["coacd"], "pip install 'frobs-models[decomposition]'") from error
    logging.getLogger(__name__).info("decomposing %s into convex parts; the result is cached", mesh.path)
    coacd.set_log_level("error")
    pieces = coacd.run_coacd(coacd.Mesh(undivided.vertices, undivided.faces), **_SETTINGS)
    return tuple(MeshPart(np.array(vertices, float), np.array(faces, np.int32)) for vertices, faces in pieces)
