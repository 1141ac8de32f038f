"""Solid bodies of a scene, which have simple shapes."""

from __future__ import annotations

from pathlib import Path

from frobs_core.errors import SceneError
from frobs_core.models.model import Box, Capsule, Cylinder, Geometry, Mesh, Sphere


def solid_moments(geometry: Geometry, mass: float) -> tuple[float, float, float]:
    """Return the principal moments of a solid body [kg·m²].

    Args:
        geometry: Its shape.
        mass: [kg]

    Raises:
        SceneError: It is a mesh.
    """
    match geometry:
        case Box((x, y, z)):
            return mass / 12 * (y * y + z * z), mass / 12 * (x * x + z * z), mass / 12 * (x * x + y * y)
        case Sphere(r):
            return (0.4 * mass * r * r,) * 3
        case Cylinder(r, length):
            across = mass * (3 * r * r + length * length) / 12
            return across, across, 0.5 * mass * r * r
        case Capsule(r, length):
            ball = mass * 4 * r / (4 * r + 3 * length)  # both halves together
            rod = mass - ball
            across = rod * (r * r / 4 + length**2 / 12) + ball * (0.4 * r * r + length**2 / 4 + 3 * length * r / 8)
            return across, across, (0.5 * rod + 0.4 * ball) * r * r
        case Mesh(path):
            raise mesh_refusal(path)


def mesh_refusal(path: Path) -> SceneError:
    """Return the error that rejects a mesh as the shape of a scene's body."""
    return SceneError(f"the mesh {path}", "cannot be a shape of a scene; use boxes, spheres, cylinders or capsules.")
