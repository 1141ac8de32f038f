"""Shapes of scene bodies in Bullet."""

from __future__ import annotations

from typing import Any

from frobs_core.interfaces import Body
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Sphere, mesh_refusal, solid_moments
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.transforms import from_pose


def add_body(client: int, body: Body) -> int:
    """Create a scene body; return Bullet's number of it."""
    shape = -1
    if body.collides:
        shape = p.createCollisionShape(**shape_keywords(body.geometry, "height"), physicsClientId=client)
    pos, quat = from_pose(body.pose)
    number: int = p.createMultiBody(body.mass or 0.0, shape, -1, pos, quat, physicsClientId=client)
    prepare(client, number, body.friction)
    if body.mass:
        moments = solid_moments(body.geometry, body.mass)
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


def shape_keywords(geometry: Geometry, length_name: str) -> dict[str, Any]:
    """Return the keywords that make a shape.

    Args:
        geometry: The shape.
        length_name: Of a length: ``"height"`` for ``createCollisionShape``, ``"length"`` for ``createVisualShape``.

    Raises:
        SceneError: It is a mesh.
    """
    match geometry:
        case Box(size):
            return {"shapeType": p.GEOM_BOX, "halfExtents": [edge / 2 for edge in size]}
        case Sphere(radius):
            return {"shapeType": p.GEOM_SPHERE, "radius": radius}
        case Cylinder(radius, length):
            return {"shapeType": p.GEOM_CYLINDER, "radius": radius, length_name: length}
        case Capsule(radius, length):
            return {"shapeType": p.GEOM_CAPSULE, "radius": radius, length_name: length}
        case Mesh(path):
            raise mesh_refusal(path)
