"""Inertia matrices, and the masses and inertias of solid shapes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.models.load import mesh_solid
from frobs_core.models.model import Box, Capsule, Collision, Cylinder, Geometry, Inertial, Mesh, Pose, Sphere, Visual
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat


def solid_inertial(
    shapes: Sequence[Visual | Collision], *, mass: float | None = None, density: float = 1000.0
) -> Inertial:
    """Return the total mass, center of mass and inertia of solid shapes with equal density, in their common frame.

    Overlapping volumes are counted once per shape.

    Args:
        shapes: At least one.
        mass: Total mass [kg], or None to compute the mass from the density.
        density: Density [kg/m³], which is ignored if ``mass`` is set.

    Raises:
        ModelFileError: A mesh cannot be read, or its volume is unknown because its surface is not closed.
    """
    solids = [solid(shape.geometry) for shape in shapes]
    turns = [matrix_from_quat(np.array(shape.origin.quat_wxyz)) for shape in shapes]
    volumes = np.array([volume for volume, _, _ in solids])
    centers = np.array([shape.origin.pos for shape in shapes]) + [
        turn @ center for turn, (_, center, _) in zip(turns, solids, strict=True)
    ]
    total = density * float(volumes.sum()) if mass is None else float(mass)
    masses = total * (volumes / volumes.sum())
    center = (masses[:, None] * centers).sum(axis=0) / total
    tensor = sum(
        turn @ (part * tensor) @ turn.T + parallel_axis(part, at - center)
        for part, at, turn, (_, _, tensor) in zip(masses, centers, turns, solids, strict=True)
    )
    ixx, ixy, ixz, iyy, iyz, izz = np.asarray(tensor)[np.triu_indices(3)].tolist()
    return Inertial(total, Pose(tuple(center.tolist())), (ixx, ixy, ixz, iyy, iyz, izz))


def solid(geometry: Geometry) -> tuple[float, Floats, Floats]:
    """Return the volume [m³], the centroid (3,) [m], and the inertia about it for a mass of 1 kg, (3, 3) [m²]."""
    match geometry:
        case Box((x, y, z)):
            volume, moments = x * y * z, [(y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12]
        case Sphere(r):
            volume, moments = 4 / 3 * np.pi * r**3, [0.4 * r * r] * 3
        case Cylinder(r, length):
            across = (3 * r * r + length * length) / 12
            volume, moments = np.pi * r * r * length, [across, across, 0.5 * r * r]
        case Capsule(r, length):
            ball = 4 * r / (4 * r + 3 * length)  # fraction of both hemispheres together
            rod = 1.0 - ball
            across = rod * (r * r / 4 + length**2 / 12) + ball * (0.4 * r * r + length**2 / 4 + 3 * length * r / 8)
            volume = np.pi * r * r * (length + 4 / 3 * r)
            moments = [across, across, (0.5 * rod + 0.4 * ball) * r * r]
        case Mesh():
            return mesh_solid(geometry)
    return volume, np.zeros(3), np.diag(moments)


def inertia_matrix(inertial: Inertial) -> Floats:
    """Return the inertia about the center of mass, expressed in the link's axes, (3, 3) [kg·m²]."""
    rotation = matrix_from_quat(inertial.origin.quat_wxyz)
    turned: Floats = rotation @ symmetric_matrix(inertial.inertia) @ rotation.T
    return turned


def parallel_axis(mass: float, arm: Floats) -> Floats:
    """Return the inertia, (3, 3) [kg·m²], that a mass [kg] adds about a point at the offset ``arm``, (3,) [m]."""
    return np.asarray(mass * ((arm * arm).sum() * np.eye(3) - np.outer(arm, arm)))


def symmetric_matrix(moments: Sequence[float]) -> Floats:
    """Return the symmetric matrix, (3, 3), of the ``moments`` ixx, ixy, ixz, iyy, iyz and izz."""
    ixx, ixy, ixz, iyy, iyz, izz = moments
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
