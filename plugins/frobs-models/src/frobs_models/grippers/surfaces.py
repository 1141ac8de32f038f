"""Points on the surfaces of the bodies of a gripper, for any joint positions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from frobs_core.models import Box, Capsule, Collision, Cylinder, Geometry, Link, Mesh, RobotModel, Sphere, Visual
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_core.util.rotations import matrix_from_quat
from frobs_models.grippers.structure import Tree
from frobs_models.meshes.mesh import joined, read_mesh, scaled

_SPACING = 0.003  # [m] mean distance between the sampled points of a surface
_FEWEST, _MOST = 600, 20_000  # numbers of points per shape


def solid_shapes(link: Link) -> tuple[Visual | Collision, ...]:
    """Return the shapes that collide, or the meshes that are drawn if none collides.

    A box or a sphere that is only drawn is often a marker, so it is not solid.
    """
    return link.collisions or tuple(shape for shape in link.visuals if isinstance(shape.geometry, Mesh))


def surface(geometry: Geometry) -> Any:
    """Return a shape as a ``trimesh.Trimesh``."""
    import trimesh

    match geometry:
        case Mesh():
            part = joined(scaled(read_mesh(geometry.path), geometry.scale))
            return trimesh.Trimesh(part.vertices, part.faces, process=False)
        case Box(size):
            return trimesh.creation.box(size)
        case Sphere(radius):
            return trimesh.creation.icosphere(radius=radius)
        case Cylinder(radius, length):
            return trimesh.creation.cylinder(radius, length)
        case Capsule(radius, length):
            return trimesh.creation.capsule(length, radius)


def placed_surface(shape: Visual | Collision) -> Any:
    """Return the surface of a shape in the frame of its link, as a ``trimesh.Trimesh``."""
    mesh, pose = surface(shape.geometry), np.eye(4)
    pose[:3, :3], pose[:3, 3] = matrix_from_quat(np.array(shape.origin.quat_wxyz)), shape.origin.pos
    mesh.apply_transform(pose)
    return mesh


class Surfaces:
    """Surface points of the bodies of a gripper, relative to its palm."""

    def __init__(self, model: RobotModel, palm: str, bodies: Iterable[str]) -> None:
        self._model, self._palm = model, palm
        self.missing: list[str] = []
        tree, links = Tree(model), {link.name: link for link in model.links}
        self._points = {
            body: {name: self._sample(links[name]) for name in tree.links(body)} for body in (palm, *bodies)
        }

    def __contains__(self, body: str) -> bool:
        """Return whether a body has a surface."""
        return any(len(points) for points in self._points[body].values())

    def points(self, body: str, joint_positions: Floats) -> Floats:
        """Return the points of a body in the frame of the palm, (n, 3) [m], for joint positions (dof,)."""
        origin, turn = self.pose(self._palm, joint_positions)
        placed = []
        for link, points in self._points[body].items():
            if len(points):
                pos, rotation = self.pose(link, joint_positions)
                placed.append((points @ rotation.T + pos - origin) @ turn)
        return np.concatenate(placed) if placed else np.zeros((0, 3))

    def pose(self, link: str, joint_positions: Floats) -> tuple[Floats, Floats]:
        """Return position (3,) [m] and rotation matrix (3, 3) of a link for joint positions (dof,)."""
        pos, quat = self._model.frame_pose(link, joint_positions[None])
        return pos[0], matrix_from_quat(quat[0])

    def _sample(self, link: Link) -> Floats:
        import trimesh

        points = [np.zeros((0, 3))]
        for shape in solid_shapes(link):
            try:
                mesh = placed_surface(shape)
            except ModelFileError:
                self.missing.append(link.name)
                continue
            points.append(np.asarray(mesh.vertices))
            if mesh.area > 0.0:
                count = int(np.clip(mesh.area / _SPACING**2, _FEWEST, _MOST))
                points.append(np.asarray(trimesh.sample.sample_surface(mesh, count, seed=0)[0]))
        return np.concatenate(points)
