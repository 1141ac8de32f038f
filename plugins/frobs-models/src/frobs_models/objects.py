"""Reads rigid objects from mesh files and URDF files."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.description import Shape
from frobs_core.models import MOVING, Box, Capsule, Collision, Cylinder, Geometry, Mesh, Pose, Sphere, Visual
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_core.util.rotations import quat_multiply, quat_rotate
from frobs_models.grippers.surfaces import placed_surface, solid_shapes
from frobs_models.load import ENDINGS, read_model
from frobs_models.meshes.convex_parts import CONVEX, convex_parts
from frobs_models.resources import resolve_path

_DENSITY = 1000.0  # [kg/m³]
_LARGEST = 1.0  # [m] a larger object is usually a mesh in millimeters
_SMALLEST = 0.001  # [m] a smaller object is usually a mesh whose scale is wrong
_FLAT = 1e-6  # minimum thickness relative to the length
_PLAUSIBLE = 0.01  # [m] length of the smallest object that is likely
_POINTS = 40_000  # number of surface points
_log = logging.getLogger("frobs")


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """A rigid object that was read from a file.

    Attributes:
        file: The file.
        shapes: Shapes in the file's frame. If the object has other visuals than collision shapes, the visuals do not
            collide.
        points: Points on the surfaces of the convex parts that collide, in the file's frame, (n, 3) [m].
        mass: [kg]
        center_of_mass: In the file's frame, (3,) [m].
        inertia: Inertia about the center of mass, in the axes of the file's frame, (3, 3) [kg·m²].
    """

    file: Path
    shapes: tuple[Shape, ...]
    points: Floats
    mass: float
    center_of_mass: Floats
    inertia: Floats


def read_object(path: str | Path, *, scale: float = 1.0, mass: float | None = None) -> ObjectModel:
    """Read a rigid object.

    A mesh that is not nearly convex is divided into convex parts for collisions if CoACD is installed; otherwise, its
    convex hull collides.

    Args:
        path: Path of a mesh file, or of a URDF, xacro or MJCF file without moving joints, or
            ``"package:relative/path"`` for a file in an installed Python package.
        scale: Factor for all lengths, > 0, such as 0.001 for a mesh in millimeters.
        mass: Mass [kg]. If None, the mass of a model file that defines one, or else the volume times 1000 kg/m³. The
            volume of a mesh whose surface is not closed is that of its convex hull.

    Raises:
        ModelFileError: The file is missing, broken, empty or too large, has moving joints, or the object is larger than
            1 m, smaller than 1 mm, or flat.
    """
    import trimesh

    file = resolve_path(path)
    if file.suffix.lower() in ENDINGS:
        stated, collisions, visuals = _read_links(file, scale)
    else:
        stated, visuals = None, None
        collisions = [_scaled(Collision(Mesh(file), Pose()), scale)]
    surfaces = [placed_surface(each) for each in collisions]
    vertices = np.concatenate([each.vertices for each in surfaces])
    extent = float(np.ptp(vertices, axis=0).max())
    if extent > _LARGEST:
        factor = float(f"{0.1 * scale / extent:.2g}")
        advice = f"object_scale={factor:g} (option --object-scale) makes it 10 cm long."
        if 0.001 * extent > _PLAUSIBLE:
            advice = f"if the file is in millimeters, set object_scale={0.001 * scale:g}; {advice}"
        raise ModelFileError(
            file,
            f"the object is {extent:.4g} m long, and at most {_LARGEST:g} m is allowed. Lengths are in meters: {advice}",
        )
    if extent < _SMALLEST:
        raise ModelFileError(
            file,
            f"the object is {1000.0 * extent:.4g} mm long, and at least {1000.0 * _SMALLEST:g} mm is required; "
            "set a larger object_scale (option --object-scale).",
        )
    thinnest = np.linalg.eigh(np.cov(vertices.T))[1][:, 0]
    if np.ptp(vertices @ thinnest) < _FLAT * extent:
        raise ModelFileError(file, "the object is flat, so it has no volume; give it a thickness.")
    shapes, hulls, solids = [], [], []
    for shape, surface in zip(collisions, surfaces, strict=True):
        divided = _divided(file, shape, surface)
        parts = list(_hulls(divided))
        shapes.append(Shape(divided.geometry, divided.origin))
        hulls += parts
        solids.append(surface if surface.is_volume else surface.convex_hull)
    if not all(surface.is_volume for surface in surfaces):
        _log.warning("%s: the surface is not closed, so the volume of its convex hull is used.", file)
    solid: Any = trimesh.util.concatenate(solids)
    mass = mass or stated or float(solid.volume) * _DENSITY
    if visuals:
        shapes = [replace(each, rgba=(0.0, 0.0, 0.0, 0.0)) for each in shapes]
        shapes += [Shape(each.geometry, each.origin, each.rgba, collides=False) for each in visuals]
    return ObjectModel(
        file=file,
        shapes=tuple(shapes),
        points=_sampled(hulls),
        mass=mass,
        center_of_mass=np.array(solid.center_mass, dtype=np.float64),
        inertia=np.array(solid.moment_inertia, dtype=np.float64) * (mass / float(solid.volume)),
    )


def _read_links(file: Path, scale: float) -> tuple[float | None, list[Collision], list[Visual] | None]:
    """Return the mass that a model file states, or None, and the scaled shapes of its links in the root's frame."""
    model = read_model(file)
    moving = [joint.name for joint in model.joints if joint.type in MOVING]
    if moving:
        raise ModelFileError(file, f"an object must be rigid, but the joint '{moving[0]}' moves; make the joint fixed.")
    collisions: list[Any] = []
    visuals: list[Any] = []
    total = 0.0
    for link in model.links:
        (pos,), (quat,) = model.frame_pose(link.name, np.zeros((1, 0)))
        for found, shapes in ((collisions, solid_shapes(link) or link.visuals), (visuals, link.visuals)):
            for shape in shapes:
                x, y, z = (pos + quat_rotate(quat, np.array(shape.origin.pos))).tolist()
                a, b, c, d = quat_multiply(quat, np.array(shape.origin.quat_wxyz)).tolist()
                found.append(_scaled(replace(shape, origin=Pose((x, y, z), (a, b, c, d))), scale))
        total += 0.0 if link.inertial is None else link.inertial.mass
    if not collisions:
        raise ModelFileError(file, "the object has no shapes.")
    return total * scale**3 or None, [Collision(each.geometry, each.origin) for each in collisions], visuals


def _scaled(shape: Any, scale: float) -> Any:
    """Return a shape with all lengths multiplied by a factor."""
    x, y, z = (scale * value for value in shape.origin.pos)
    geometry: Geometry = shape.geometry
    match geometry:
        case Mesh():
            a, b, c = (scale * value for value in geometry.scale)
            geometry = replace(geometry, scale=(a, b, c))
        case Box((a, b, c)):
            geometry = Box((scale * a, scale * b, scale * c))
        case Sphere(radius):
            geometry = Sphere(scale * radius)
        case Cylinder(radius, length) | Capsule(radius, length):
            geometry = type(geometry)(scale * radius, scale * length)
    return replace(shape, geometry=geometry, origin=Pose((x, y, z), shape.origin.quat_wxyz))


def _divided(file: Path, shape: Collision, surface: Any) -> Collision:
    """Return a shape whose mesh is divided into convex parts, unless it is nearly convex."""
    if not isinstance(shape.geometry, Mesh) or len(surface.faces) < 4:
        return shape
    if surface.is_volume and surface.volume >= CONVEX * surface.convex_hull.volume:
        return shape
    if find_spec("coacd") is None:
        _log.warning(
            "%s: the mesh is not convex, and its convex hull is used for collisions, because CoACD is not installed; "
            "install it: pip install 'frobs-models[decomposition]'",
            file,
        )
        return shape
    return replace(shape, geometry=replace(shape.geometry, decomposed=True))


def _hulls(shape: Collision) -> Iterator[Any]:
    """Yield the convex parts of a shape as ``trimesh.Trimesh``."""
    import trimesh

    if not isinstance(shape.geometry, Mesh):
        yield placed_surface(shape)
        return
    for part in convex_parts(shape.geometry):
        points = quat_rotate(np.array(shape.origin.quat_wxyz), part.vertices) + np.array(shape.origin.pos)
        yield trimesh.convex.convex_hull(points)


def _sampled(hulls: list[Any]) -> Floats:
    import trimesh

    area = sum(hull.area for hull in hulls)
    points = [np.asarray(hull.vertices) for hull in hulls]
    for hull in hulls:
        count = int(np.ceil(_POINTS * hull.area / area))
        points.append(np.asarray(trimesh.sample.sample_surface(hull, count, seed=0)[0]))
    return np.concatenate(points)
