"""Converts shapes to Gazebo elements. A shape may be converted to several elements."""

from __future__ import annotations

from xml.sax.saxutils import escape

from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Pose, Sphere
from frobs_core.util.arrays import Floats
from frobs_sim_gazebo.meshes import MeshFiles

_UNTURNED = (1.0, 0.0, 0.0, 0.0)


def elements(geometry: Geometry, meshes: MeshFiles) -> list[tuple[str, Pose]]:
    """Return the contents of a shape's ``<geometry>`` elements, each with a pose in the shape's frame."""
    match geometry:
        case Box(size):
            return [(f"<box><size>{numbers(size)}</size></box>", Pose())]
        case Sphere(radius):
            return [(_sphere(radius), Pose())]
        case Cylinder(radius, length):
            return [(_cylinder(radius, length), Pose())]
        case Capsule(radius, length):  # not supported by Gazebo 11
            ends = [(_sphere(radius), Pose((0.0, 0.0, side * length / 2), _UNTURNED)) for side in (-1.0, 1.0)]
            return [(_cylinder(radius, length), Pose()), *ends]
        case Mesh():
            return [(f"<mesh><uri>{escape(uri)}</uri></mesh>", Pose()) for uri in meshes.hulls(geometry)]


def numbers(values: tuple[float, ...] | Floats) -> str:
    """Format numbers for XML with full precision."""
    return " ".join(repr(float(value)) for value in values)


def _sphere(radius: float) -> str:
    return f"<sphere><radius>{float(radius)!r}</radius></sphere>"


def _cylinder(radius: float, length: float) -> str:
    return f"<cylinder><radius>{float(radius)!r}</radius><length>{float(length)!r}</length></cylinder>"
