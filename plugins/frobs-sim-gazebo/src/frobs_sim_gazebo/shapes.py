"""Shapes as Gazebo has them: one of ours may be several of its own."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError, SceneError
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Pose, Sphere
from frobs_sim_gazebo.meshes import MeshFiles

_UNTURNED = (1.0, 0.0, 0.0, 0.0)


def elements(geometry: Geometry, meshes: MeshFiles) -> list[tuple[str, Pose]]:
    """Return the ``<geometry>`` elements that make a shape, each with its place in it."""
    match geometry:
        case Box(size):
            return [(f"<box><size>{numbers(size)}</size></box>", Pose())]
        case Sphere(radius):
            return [(_sphere(radius), Pose())]
        case Cylinder(radius, length):
            return [(_cylinder(radius, length), Pose())]
        case Capsule(radius, length):  # which Gazebo 11 does not know
            ends = [(_sphere(radius), Pose((0.0, 0.0, side * length / 2), _UNTURNED)) for side in (-1.0, 1.0)]
            return [(_cylinder(radius, length), Pose()), *ends]
        case Mesh():
            uri = escape(meshes.hull(geometry))
            return [(f"<mesh><uri>{uri}</uri></mesh>", Pose())]


def moments(geometry: Geometry, mass: float) -> Floats:
    """Return the principal moments of a solid body of the scene, (3,) [kg·m²].

    Raises:
        ConfigurationError: It is a mesh.
    """
    match geometry:
        case Box((x, y, z)):
            return mass / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
        case Sphere(r):
            return np.full(3, 0.4 * mass * r * r)
        case Cylinder(r, length):
            across = mass * (3.0 * r * r + length * length) / 12.0
            return np.array([across, across, 0.5 * mass * r * r])
        case Capsule(r, length):
            ends = mass * 4.0 * r / (4.0 * r + 3.0 * length)  # both half spheres together
            rod = mass - ends
            across = rod * (r * r / 4 + length**2 / 12) + ends * (0.4 * r * r + length**2 / 4 + 3 * length * r / 8)
            return np.array([across, across, (0.5 * rod + 0.4 * ends) * r * r])
        case Mesh(path):
            raise mesh_refusal(path)


def mesh_refusal(path: Path) -> ConfigurationError:
    """Return the error that refuses a mesh in a scene."""
    return SceneError(f"the mesh {path}", "cannot be a shape of a scene; use boxes, spheres, cylinders or capsules.")


def numbers(values: tuple[float, ...] | Floats) -> str:
    """Return numbers as XML has them, to the last digit."""
    return " ".join(repr(float(value)) for value in values)


def _sphere(radius: float) -> str:
    return f"<sphere><radius>{float(radius)!r}</radius></sphere>"


def _cylinder(radius: float, length: float) -> str:
    return f"<cylinder><radius>{float(radius)!r}</radius><length>{float(length)!r}</length></cylinder>"
