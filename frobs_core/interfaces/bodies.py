"""Bodies of a scene: their shapes and masses."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from frobs_core.errors import SceneError
from frobs_core.models.model import Box, Capsule, Collision, Cylinder, Geometry, Inertial, Mesh, Pose, Sphere, Vector3
from frobs_core.models.solids import solid_inertial
from frobs_core.validation import number_list

Twist: TypeAlias = tuple[Vector3, Vector3]
"""Linear velocity [m/s] and angular velocity [rad/s]."""

AT_REST: Twist = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shape:
    """One of several shapes of a body.

    Attributes:
        geometry: The shape's geometry.
        pose: Pose in the body's frame.
        rgba: Color, each component in [0, 1], or None for the body's color.
        collides: Whether it collides. If not, it is only rendered.
    """

    geometry: Geometry
    pose: Pose = field(default_factory=Pose)
    rgba: tuple[float, float, float, float] | None = None
    collides: bool = True


@dataclass(frozen=True, kw_only=True)
class Body:
    """An object in the scene, with one shape or several shapes fixed to each other.

    A body with a mass or a density is free. Other bodies are static or kinematic. If ``center_of_mass`` and ``inertia``
    are omitted, they are computed from its colliding shapes (or from all shapes if none of them collides), as solids of
    uniform density.

    Attributes:
        geometry: Its only shape, for collision and rendering. A mesh collides as its convex hull, or as a set of convex
            pieces if it is ``decomposed``.
        shapes: Its shapes, instead of ``geometry``.
        pose: Pose in the world at reset.
        twist: Linear velocity of its origin [m/s] and angular velocity [rad/s] in the world, at reset.
        mass: [kg]
        density: [kg/m³], instead of ``mass``.
        center_of_mass: In its frame [m].
        inertia: (ixx, ixy, ixz, iyy, iyz, izz) about the center of mass, in the axes of its frame [kg·m²].
        kinematic: Whether it moves only when its pose is written. It must not have a mass.
        collides: Whether it collides with other bodies.
        friction: Coefficient of sliding friction. If a free body slides over the floor, MuJoCo and PyBullet use the
            larger of the two coefficients, and Gazebo the smaller one.
        torsional_friction: Maximum torque about the contact normal, per normal force [m], or 0 for none.
        rolling_friction: Maximum torque that resists rolling, per normal force [m], or 0 for none.
        rgba: Color, each component in [0, 1].

    Raises:
        ConfigurationError: It has both or neither of ``geometry`` and ``shapes``; both a mass and a density; an
            inertia, a center of mass or a twist but no mass; or an inertia that is physically impossible.
    """

    geometry: Geometry | None = None
    shapes: tuple[Shape, ...] = ()
    pose: Pose = field(default_factory=Pose)
    twist: Twist = AT_REST
    mass: float | None = None
    density: float | None = None
    center_of_mass: Vector3 | None = None
    inertia: tuple[float, float, float, float, float, float] | None = None
    kinematic: bool = False
    collides: bool = True
    friction: float = 1.0
    torsional_friction: float = 0.0
    rolling_friction: float = 0.0
    rgba: tuple[float, float, float, float] = (0.6, 0.6, 0.65, 1.0)

    def __post_init__(self) -> None:
        """Check that the fields are consistent."""
        if (self.geometry is None) == (not self.shapes):
            raise SceneError("a scene body", "needs either a geometry or shapes; pass exactly one of them.")
        if self.mass is not None and self.density is not None:
            raise SceneError("a scene body", "has a mass and a density; pass only one of them.")
        if not self.is_free and (self.center_of_mass or self.inertia or self.twist != AT_REST):
            raise SceneError("a scene body", "has no mass, so it cannot have a center_of_mass, inertia or twist.")
        if self.inertia is not None:
            ixx, ixy, ixz, iyy, iyz, izz = number_list("inertia", self.inertia, 6)
            moments = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])  # ascending
            if not (moments[0] > 0.0 and moments[0] + moments[1] >= moments[2] * (1.0 - 1e-9)):
                text = ", ".join(f"{moment:.4g}" for moment in moments)
                raise SceneError(
                    "a scene body",
                    f"has an impossible inertia: its principal moments are {text} kg·m². Each must be above 0, "
                    "and the sum of two at least the third.",
                )

    @property
    def is_free(self) -> bool:
        """Whether it has a mass and therefore reacts to forces."""
        return self.mass is not None or self.density is not None

    @cached_property
    def parts(self) -> tuple[Shape, ...]:
        """Its shapes, each with its color. ``collides`` is True only if the body collides too."""
        shapes = self.shapes if self.geometry is None else (Shape(self.geometry),)
        return tuple(
            replace(shape, rgba=shape.rgba or self.rgba, collides=shape.collides and self.collides) for shape in shapes
        )

    @cached_property
    def collisions(self) -> tuple[Collision, ...]:
        """Its colliding shapes."""
        return tuple(Collision(part.geometry, part.pose) for part in self.parts if part.collides)

    @cached_property
    def inertial(self) -> Inertial | None:
        """Its mass, center of mass and inertia, or None if it is not free.

        Raises:
            ModelFileError: They depend on a mesh that cannot be read or whose surface is not closed.
        """
        if not self.is_free:
            return None
        center, inertia = self.center_of_mass, self.inertia
        if self.mass is None or center is None or inertia is None:
            shapes = self.collisions or [Collision(part.geometry, part.pose) for part in self.parts]
            solid = solid_inertial(shapes, mass=self.mass, density=self.density or 0.0)
            return Inertial(solid.mass, solid.origin if center is None else Pose(center), inertia or solid.inertia)
        return Inertial(self.mass, Pose(center), inertia)

    @property
    def is_sizable(self) -> bool:
        """Whether its size can differ between environments. All its shapes must be primitives."""
        return not any(isinstance(part.geometry, Mesh) for part in self.parts)

    def resized(self, factor: float) -> Body:
        """Return a copy of this body with all lengths multiplied by a factor. Its mass does not change.

        Args:
            factor: > 0. The body must be sizable.
        """
        if factor == 1.0:
            return self
        shapes = tuple(
            replace(
                part,
                geometry=_scaled(part.geometry, factor),
                pose=Pose(_times(part.pose.pos, factor), part.pose.quat_wxyz),
            )
            for part in self.parts
        )
        return replace(
            self,
            geometry=None,
            shapes=shapes,
            mass=None if self.inertial is None else self.inertial.mass,
            density=None,
            center_of_mass=None if self.center_of_mass is None else _times(self.center_of_mass, factor),
            inertia=None if self.inertia is None else _times(self.inertia, factor**2),
        )


def _scaled(geometry: Geometry, factor: float) -> Geometry:
    match geometry:
        case Box(size):
            return Box(_times(size, factor))
        case Sphere(radius):
            return Sphere(factor * radius)
        case Cylinder(radius, length) | Capsule(radius, length):
            return type(geometry)(factor * radius, factor * length)
    raise TypeError(f"{geometry} is not a primitive.")


def _times(numbers: tuple[float, ...], factor: float) -> Any:
    return tuple(factor * number for number in numbers)
