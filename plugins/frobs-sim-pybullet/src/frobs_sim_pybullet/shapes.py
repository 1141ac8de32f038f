"""Scene bodies in Bullet."""

from __future__ import annotations

from typing import Any

from frobs_core.description import Body
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Link, Mesh, Pose, Sphere
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.engine import MARGIN, load_urdf
from frobs_sim_pybullet.meshes import MeshFiles
from frobs_sim_pybullet.transforms import compose, from_pose
from frobs_sim_pybullet.urdf import write_link_urdf


def add_body(client: int, body: Body, meshes: MeshFiles) -> int:
    """Create a scene body, and return its Bullet index."""
    if is_plain(body):
        number = _add_plain_body(client, body)
    else:
        link = Link("body", body.inertial, collisions=body.collisions)
        number = load_urdf(write_link_urdf(link, meshes), client, fixed=not body.is_free)
        com = p.getDynamicsInfo(number, -1, client)[3:5]
        p.resetBasePositionAndOrientation(number, *compose(from_pose(body.pose), com), client)
        p.changeDynamics(number, -1, collisionMargin=MARGIN, physicsClientId=client)
    prepare(client, number, body.friction, body.torsional_friction, body.rolling_friction)
    return number


def is_plain(body: Body) -> bool:
    """Return whether a body is a single primitive at its frame's origin, with a diagonal inertia matrix."""
    part, inertial = body.parts[0], body.inertial
    return (
        len(body.parts) == 1
        and part.pose == Pose()
        and not isinstance(part.geometry, Mesh)
        and (inertial is None or (inertial.origin == Pose() and not any(inertial.inertia[i] for i in (1, 2, 4))))
    )


def _add_plain_body(client: int, body: Body) -> int:
    shape = -1
    if body.collisions:
        shape = p.createCollisionShape(**shape_keywords(body.parts[0].geometry, "height"), physicsClientId=client)
    mass = 0.0 if body.inertial is None else body.inertial.mass
    number: int = p.createMultiBody(mass, shape, -1, *from_pose(body.pose), physicsClientId=client)
    if body.inertial is not None:
        ixx, _, _, iyy, _, izz = body.inertial.inertia
        p.changeDynamics(number, -1, localInertiaDiagonal=(ixx, iyy, izz), physicsClientId=client)
    return number


def prepare(client: int, number: int, friction: float, torsional: float = 0.0, rolling: float = 0.0) -> None:
    """Set a body's friction, and disable Bullet's damping, restitution, sleeping and velocity limit."""
    p.changeDynamics(
        number,
        -1,
        linearDamping=0.0,
        angularDamping=0.0,
        lateralFriction=friction,
        rollingFriction=rolling,
        spinningFriction=torsional,
        restitution=0.0,
        maxJointVelocity=1e9,
        activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING,
        physicsClientId=client,
    )


def shape_keywords(geometry: Geometry, length_name: str) -> dict[str, Any]:
    """Return the keyword arguments for creating a primitive shape in Bullet.

    Args:
        geometry: The primitive.
        length_name: Keyword for the length, which is ``"height"`` for ``createCollisionShape`` and ``"length"`` for
            ``createVisualShape``.
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
    raise TypeError(f"{geometry} is not a primitive.")
