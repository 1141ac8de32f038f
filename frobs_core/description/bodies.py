"""Scene bodies, with their shapes and masses."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from frobs_core.models.model import Box, Capsule, Collision, Cylinder, Geometry, Inertial, Mesh, Pose, Sphere, Vector3
from frobs_core.models.solids import solid_inertial
from frobs_core.util.errors import SceneError
from frobs_core.util.validation import number_list

Twist: TypeAlias = tuple[Vector3, Vector3]
"""Linear velocity [m/s] and angular velocity [rad/s]."""

AT_REST: Twist = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shape:
    """A geometric shape that is part of a body.

    Attributes:
        geometry: The shape's geometry.
        pose: Pose in the body's frame.
        rgba: Color, each component in [0, 1], or None for the body's color.
        collides: Whether the shape collides with other bodies, instead of only being rendered.
    """

    geometry: Geometry
    pose: Pose = field(default_factory=Pose)
    rgba: tuple[float, float, float, float] | None = None
    collides: bool = True


@dataclass(frozen=True, kw_only=True)
class Body:
    """An object in the scene, with one or more shapes that are rigidly connected.

    A body with a mass or a density is free. Other bodies are static or kinematic. If ``center_of_mass`` and ``inertia``
    are omitted, they are computed from the body's colliding shapes (or from all its shapes if none of them collides),
    which are treated as solids of uniform density.

    Attributes:
        geometry: The body's only shape, for collision and rendering. Collisions of a mesh are computed for its convex
            hull, or for a set of convex pieces if the mesh is ``decomposed``.
        shapes: The body's shapes, as an alternative to ``geometry``.
        pose: Pose in the world frame at reset.
        twist: Linear velocity of the body's origin [m/s] and angular velocity [rad/s] in the world frame, at reset.
        mass: [kg]
        density: [kg/m³], instead of ``mass``.
        center_of_mass: Position of the center of mass in the body's frame [m].
        inertia: Inertia tensor (ixx, ixy, ixz, iyy, iyz, izz) about the center of mass, in the axes of the body's frame
            [kg·m²].
        kinematic: Whether the body moves only when its pose is written. A kinematic body must not have a mass.
        collides: Whether the body collides with other bodies.
        friction: Coefficient of sliding friction. When a free body slides over the floor, MuJoCo and PyBullet use the
            larger of the body's and the floor's friction coefficients, and Gazebo uses the smaller one.
        torsional_friction: Maximum friction torque about the contact normal, divided by the normal force [m]. 0
            disables torsional friction.
        rolling_friction: Maximum torque that resists rolling, divided by the normal force [m]. 0 disables rolling
            friction.
        rgba: Color, each component in [0, 1].

    Raises:
        ConfigurationError: Both or neither of ``geometry`` and ``shapes`` are set, both a mass and a density are set,
            the inertia is physically impossible, or an inertia, a center of mass or a twist is set without a mass or
            density.
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
        if (self.geometry is None) == (not self.shapes):
            raise SceneError("a scene body", "needs either a geometry or shapes; pass exactly one of them.")
        if self.mass is not None and self.density is not None:
            raise SceneError("a scene body", "has both a mass and a density; pass only one of them.")
        if not self.is_free and (self.center_of_mass or self.inertia or self.twist != AT_REST):
            raise SceneError("a scene body", "has no mass, so it cannot have a center_of_mass, inertia or twist.")
        if self.inertia is not None:
            ixx, ixy, ixz, iyy, iyz, izz = number_list("inertia", self.inertia, 6)
            moments = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])  # ascending
            if not (moments[0] > 0.0 and moments[0] + moments[1] >= moments[2] * (1.0 - 1e-9)):
                text = ", ".join(f"{moment:.4g}" for moment in moments)
                raise SceneError(
                    "a scene body",
                    f"has a physically impossible inertia: its principal moments are {text} kg·m². Each principal "
                    "moment must be above 0 and at most the sum of the other two.",
                )

    @property
    def is_free(self) -> bool:
        """Whether the body has a mass and therefore reacts to forces."""
        return self.mass is not None or self.density is not None

    @cached_property
    def parts(self) -> tuple[Shape, ...]:
        """The body's shapes, each with a color. A shape's ``collides`` is True only if the body also collides."""
        shapes = self.shapes if self.geometry is None else (Shape(self.geometry),)
        return tuple(
            replace(shape, rgba=shape.rgba or self.rgba, collides=shape.collides and self.collides) for shape in shapes
        )

    @cached_property
    def collisions(self) -> tuple[Collision, ...]:
        """The body's colliding shapes."""
        return tuple(Collision(part.geometry, part.pose) for part in self.parts if part.collides)

    @cached_property
    def inertial(self) -> Inertial | None:
        """The body's mass, center of mass and inertia, or None if the body is not free.

        Raises:
            ModelFileError: The mass or inertia depends on a mesh that cannot be read or whose surface is not closed.
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
        """Whether the body's size can differ between environments, which requires that all its shapes be primitives."""
        return not any(isinstance(part.geometry, Mesh) for part in self.parts)

    def resized(self, factor: float) -> Body:
        """Return a copy of this body with all lengths multiplied by a factor. The mass does not change.

        Args:
            factor: Scale factor, > 0. The body must be resizable unless the factor is 1.
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
