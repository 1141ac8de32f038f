"""Converts the objects of a planning scene to obstacles for the planner."""

from __future__ import annotations

import hashlib
import tempfile
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.description import Body, Shape
from frobs_core.models import Box, Collision, Cylinder, Geometry, Mesh, Sphere, compose, pose_from_array
from frobs_models import MeshPart, joined, read_mesh, scaled, write_stl
from frobs_rl_compat.moveit import poses
from frobs_rl_compat.moveit.errors import MoveItCommanderException


def body(collision_object: Any) -> Body:
    """Convert a ``moveit_msgs/CollisionObject`` to a body at the message's pose, ignoring the message's frame."""
    shapes = tuple(Shape(collision.geometry, collision.origin) for collision in collisions(collision_object))
    return Body(shapes=shapes, pose=pose_from_array(poses.from_message(collision_object.pose)))


def collisions(collision_object: Any) -> tuple[Collision, ...]:
    """Return the shapes of a ``moveit_msgs/CollisionObject`` in the object's own frame."""
    name = collision_object.id
    if collision_object.planes:
        raise MoveItCommanderException(
            f"the object '{name}' contains a plane, which is not supported; use a large, thin box instead."
        )
    pieces = []
    for read, shapes, places in (
        (_primitive, collision_object.primitives, collision_object.primitive_poses),
        (_mesh, collision_object.meshes, collision_object.mesh_poses),
    ):
        for shape, place in zip_longest(shapes, places[: len(shapes)]):
            pose = poses.IDENTITY if place is None else poses.from_message(place)
            pieces.append(Collision(read(name, shape), pose_from_array(pose)))
    if not pieces:
        raise MoveItCommanderException(f"the object '{name}' has no shapes.")
    return tuple(pieces)


def _primitive(name: str, primitive: Any) -> Geometry:
    lengths = [float(number) for number in primitive.dimensions]
    kinds: dict[int, tuple[int, Any]] = {
        primitive.BOX: (3, lambda x, y, z: Box((x, y, z))),
        primitive.SPHERE: (1, Sphere),
        primitive.CYLINDER: (2, lambda height, radius: Cylinder(radius, height)),
    }
    if primitive.type not in kinds:
        raise MoveItCommanderException(
            f"the object '{name}' contains a shape of the unsupported type {primitive.type}; use boxes, spheres, "
            "cylinders or meshes."
        )
    count, make = kinds[primitive.type]
    if len(lengths) != count or not all(0.0 < length < np.inf for length in lengths):
        raise MoveItCommanderException(
            f"the object '{name}' contains a shape with the dimensions {lengths}; the number of dimensions must be "
            f"{count}, and all of them must be above 0."
        )
    geometry: Geometry = make(*lengths)
    return geometry


def _mesh(name: str, mesh: Any) -> Mesh:
    """Convert a mesh message to a mesh file, which is written only once for each distinct mesh."""
    vertices = np.array([[point.x, point.y, point.z] for point in mesh.vertices], float).reshape(-1, 3)
    faces = np.array([list(triangle.vertex_indices) for triangle in mesh.triangles], np.int32).reshape(-1, 3)
    if not len(faces) or faces.max() >= len(vertices) or not np.isfinite(vertices).all():
        raise MoveItCommanderException(
            f"the mesh of the object '{name}' has no triangles, has non-finite coordinates, or refers to missing "
            "vertices."
        )
    digest = hashlib.sha256(vertices.tobytes() + faces.tobytes()).hexdigest()[:16]
    path = Path(_mesh_folder().name, f"{digest}.stl")
    if not path.is_file():
        write_stl(MeshPart(vertices, faces), path)
    return Mesh(path)


@cache
def _mesh_folder() -> tempfile.TemporaryDirectory[str]:
    """Return a temporary folder for meshes, which is deleted when the process ends."""
    return tempfile.TemporaryDirectory(prefix="frobs-moveit-")


def mesh_message(path: str, scale: tuple[float, float, float]) -> Any:
    """Read a mesh file and convert it to ``shape_msgs/Mesh``."""
    from geometry_msgs.msg import Point
    from shape_msgs.msg import Mesh as Message
    from shape_msgs.msg import MeshTriangle

    x, y, z = map(float, scale)
    part = joined(scaled(read_mesh(Path(path).expanduser()), (x, y, z)))
    triangles = [MeshTriangle(vertex_indices=face) for face in part.faces.tolist()]
    return Message(triangles=triangles, vertices=[Point(*vertex) for vertex in part.vertices.tolist()])


def append(known: Any, added: Any) -> None:
    """Add the shapes of one collision object to another object in the same frame, without moving the shapes."""
    into = poses.inverse(poses.from_message(known.pose))
    outer = compose(into, poses.from_message(added.pose))
    for shapes, places in (("primitives", "primitive_poses"), ("meshes", "mesh_poses")):
        for item in (known, added):
            missing = len(getattr(item, shapes)) - len(getattr(item, places))
            setattr(item, places, [*getattr(item, places), *[poses.to_message(poses.IDENTITY)] * missing])
        moved = [poses.to_message(compose(outer, poses.from_message(pose))) for pose in getattr(added, places)]
        setattr(known, shapes, [*getattr(known, shapes), *getattr(added, shapes)])
        setattr(known, places, [*getattr(known, places), *moved])
