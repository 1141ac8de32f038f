"""Shapes of scene bodies in Bullet."""

from __future__ import annotations

from pathlib import Path

from frobs_core.errors import ConfigurationError, SceneError
from frobs_core.interfaces import Body
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.transforms import Vector, from_pose


def add_body(client: int, body: Body) -> int:
    """Create a scene body; return Bullet's number of it."""
    shape = _collision_shape(client, body.geometry) if body.collides else -1
    pos, quat = from_pose(body.pose)
    number: int = p.createMultiBody(body.mass or 0.0, shape, -1, pos, quat, physicsClientId=client)
    prepare(client, number, body.friction)
    if body.mass:
        moments = inertia(body.geometry, body.mass)
        p.changeDynamics(number, -1, localInertiaDiagonal=moments, physicsClientId=client)
    return number


def prepare(client: int, number: int, friction: float) -> None:
    """Turn off what Bullet adds to a body's own mechanics."""
    p.changeDynamics(
        number,
        -1,
        linearDamping=0.0,
        angularDamping=0.0,
        lateralFriction=friction,
        rollingFriction=0.0,
        spinningFriction=0.0,
        restitution=0.0,
        maxJointVelocity=1e9,
        activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING,
        physicsClientId=client,
    )


def inertia(geometry: Geometry, mass: float) -> Vector:
    """Return the principal moments of a solid body [kg·m²]."""
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


def _collision_shape(client: int, geometry: Geometry) -> int:
    match geometry:
        case Box(size):
            halves = [edge / 2 for edge in size]
            return int(p.createCollisionShape(p.GEOM_BOX, halfExtents=halves, physicsClientId=client))
        case Sphere(radius):
            return int(p.createCollisionShape(p.GEOM_SPHERE, radius=radius, physicsClientId=client))
        case Cylinder(radius, length):
            return int(p.createCollisionShape(p.GEOM_CYLINDER, radius=radius, height=length, physicsClientId=client))
        case Capsule(radius, length):
            return int(p.createCollisionShape(p.GEOM_CAPSULE, radius=radius, height=length, physicsClientId=client))
        case Mesh(path):
            raise mesh_refusal(path)


def mesh_refusal(path: Path) -> ConfigurationError:
    """Return the error that refuses a mesh in a scene."""
    return SceneError(f"the mesh {path}", "cannot be a shape of a scene; use boxes, spheres, cylinders or capsules.")
