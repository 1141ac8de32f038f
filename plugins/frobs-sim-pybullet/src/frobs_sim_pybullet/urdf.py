"""Writes a robot's model as a URDF for Bullet.

The URDF is generated from the parsed model, regardless of the format of the robot's file. Each link's inertia is
written along the link's principal axes, because Bullet would compute these axes with only six digits. A link without a
mass and without shapes is omitted and represented only by its pose relative to another link.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from frobs_core.models import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    JointType,
    Link,
    Mesh,
    Pose,
    RobotModel,
    Sphere,
    Visual,
)
from frobs_core.util.errors import ModelFileError
from frobs_core.util.rotations import matrix_from_quat, quat_from_matrix
from frobs_models import joints_below
from frobs_sim_pybullet.meshes import MeshFiles
from frobs_sim_pybullet.transforms import IDENTITY, Quat, Vector, compose, from_pose, invert, rpy_from_quat

_GREY = (0.7, 0.7, 0.72, 1.0)
_WEIGHTLESS = Inertial(0.0, Pose(), (0.0,) * 6)
NET = {JointType.REVOLUTE: 0.02, JointType.PRISMATIC: 0.002}
"""Distance beyond a position limit at which Bullet stops a joint, by joint type [rad or m].

At the position limit itself, the drive law stops the joint.
"""

VIRTUAL = 6
"""Number of virtual joints of a floating base in the dynamics model: three prismatic and three revolute joints."""


@dataclass(frozen=True)
class Skeleton:
    """The links of a model that are separate bodies in Bullet, and the other links' poses in the bodies' frames.

    Attributes:
        bodies: Names of the links that are separate bodies, with the base first.
        frames: For each link, the name of the body that carries the link, and the link's pose in the body's frame.
        joints: Joints whose child is a separate body, each with the name of the parent body and the joint's pose in the
            parent body's frame.
        root: Pose of the root link in the base's frame.
        welds: For each body, the first body in its group of rigidly connected bodies.
    """

    bodies: tuple[str, ...]
    frames: Mapping[str, tuple[str, tuple[Vector, Quat]]]
    joints: tuple[tuple[Joint, str, tuple[Vector, Quat]], ...]
    root: tuple[Vector, Quat]
    welds: Mapping[str, str]


def skeleton(model: RobotModel, *, floating: bool) -> Skeleton:
    """Determine which links of a model are separate bodies in Bullet.

    The base is normally the root link. However, Bullet treats a floating base without a mass as fixed. Therefore, if a
    floating root link has no mass, the first link that has a mass and is fixed to the root becomes the base.
    """
    links = {link.name: link for link in model.links}
    children = joints_below(model)
    frames, joints, bodies = {model.root: (model.root, IDENTITY)}, [], [model.root]
    queue = [model.root]
    while queue:
        name = queue.pop(0)
        body, at = frames[name]
        for joint in children.get(name, ()):
            origin = compose(at, from_pose(joint.origin))
            if joint.type is not JointType.FIXED or _is_body(links[joint.child]):
                joints.append((joint, body, origin))
                bodies.append(joint.child)
                frames[joint.child] = joint.child, IDENTITY
            else:
                frames[joint.child] = body, origin
            queue.append(joint.child)
    place = IDENTITY
    if floating and links[model.root].inertial is None:
        place = _hang_from_a_weight(model, links, bodies, frames, joints)
    welds = {bodies[0]: bodies[0]}
    for joint, parent, _ in joints:  # parents come first
        welds[joint.child] = welds[parent] if joint.type is JointType.FIXED else joint.child
    return Skeleton(tuple(bodies), frames, tuple(joints), place, welds)


def _hang_from_a_weight(
    model: RobotModel,
    links: Mapping[str, Link],
    bodies: list[str],
    frames: dict[str, tuple[str, tuple[Vector, Quat]]],
    joints: list[tuple[Joint, str, tuple[Vector, Quat]]],
) -> tuple[Vector, Quat]:
    """Select a base that has a mass and is fixed to the root, and return the root's pose in the base's frame."""
    root = model.root
    for fixture in joints:
        joint, parent, place = fixture
        if parent == root and joint.type is JointType.FIXED and links[joint.child].inertial is not None:
            break
    else:
        raise ModelFileError(
            model.path,
            f"the root link '{root}' and the links fixed to it have no mass, but a free base requires a mass.",
        )
    base, back = joint.child, invert(place)
    joints.remove(fixture)
    bodies.remove(base)
    bodies.insert(0, base)
    if _is_body(links[root]):
        joints.insert(0, (Joint(joint.name, JointType.FIXED, base, root), base, back))
        return back
    bodies.remove(root)
    for name, (body, offset) in frames.items():
        if body == root:
            frames[name] = base, compose(back, offset)
    for i, (other, carrier, origin) in enumerate(joints):
        if carrier == root:
            joints[i] = other, base, compose(back, origin)
    return back


def _is_body(link: Link) -> bool:
    return link.inertial is not None or bool(link.collisions or link.visuals)


def write_urdf(
    model: RobotModel, meshes: MeshFiles, *, floating: bool, collisions: bool = True, visuals: bool = False
) -> str:
    """Return the URDF that Bullet simulates or renders.

    Args:
        model: Model of the robot.
        meshes: Writer for the mesh files to which the URDF refers.
        floating: Whether the base moves.
        collisions: Whether to include collision shapes.
        visuals: Whether to include visual shapes. If a link has no visual shapes, the link's collision shapes are
            included instead.
    """
    bones, links = skeleton(model, floating=floating), {link.name: link for link in model.links}
    lines = [f"<robot name={quoteattr(model.name)}>"]
    for name in bones.bodies:
        lines += _link(links[name], meshes, collisions=collisions, visuals=visuals)
    lines += [_joint(*joint) for joint in bones.joints]
    return "\n".join([*lines, "</robot>"])


def write_link_urdf(link: Link, meshes: MeshFiles, *, visuals: bool = False) -> str:
    """Return the URDF for a single link. See :func:`write_urdf` for the arguments."""
    lines = _link(link, meshes, collisions=not visuals, visuals=visuals)
    return "\n".join(['<robot name="body">', *lines, "</robot>"])


def _link(link: Link, meshes: MeshFiles, *, collisions: bool, visuals: bool) -> list[str]:
    lines = [f"<link name={quoteattr(link.name)}>", _inertial(link.inertial or _WEIGHTLESS)]
    if collisions:
        lines += [_collision(inner, shape) for shape in link.collisions for inner in _solids(shape.geometry, meshes)]
    if visuals:
        lines += [visual for shape in link.visuals or link.collisions for visual in _visuals(shape, meshes)]
    return [*lines, "</link>"]


def position_range(joint: Joint) -> tuple[float, float] | None:
    """Return a joint's position range [rad or m], or None if the joint has no position limits."""
    lower, upper = joint.limits.lower, joint.limits.upper
    limited = joint.type in NET and math.isfinite(lower) and math.isfinite(upper)
    return (lower, upper) if limited else None


def write_dynamics_urdf(model: RobotModel, masses: Mapping[str, float], *, floating: bool) -> str:
    """Return a URDF without shapes and with a fixed base, for computing mass matrices and bias forces.

    A floating base is connected to the fixed base by six virtual joints, because Bullet's inverse dynamics supports
    only fixed bases.

    Args:
        model: Model of the robot.
        masses: Changed link masses [kg], by link name. The inertias of these links are scaled by the same ratios as the
            masses.
        floating: Whether the base moves.
    """
    bones, links = skeleton(model, floating=floating), {link.name: link for link in model.links}
    lines = ['<robot name="dynamics">']
    if floating:
        parent = "frobs:world"
        lines += [f'<link name="{parent}">', _inertial(_WEIGHTLESS), "</link>"]
        for k in range(VIRTUAL):
            child = f"frobs:{k}" if k < VIRTUAL - 1 else bones.bodies[0]
            if k < VIRTUAL - 1:
                lines += [f'<link name="{child}">', _inertial(_WEIGHTLESS), "</link>"]
            axis = float(k % 3 == 0), float(k % 3 == 1), float(k % 3 == 2)
            kind = JointType.PRISMATIC if k < 3 else JointType.CONTINUOUS
            lines.append(_joint(Joint(f"frobs:{k}", kind, parent, child, axis=axis), parent, IDENTITY))
            parent = child
    for name in bones.bodies:
        inertial = links[name].inertial or _WEIGHTLESS
        if name == bones.bodies[0] and not floating:
            inertial = _WEIGHTLESS  # if the base had a mass, Bullet would use its center of mass as the origin
        lines += [f"<link name={quoteattr(name)}>", _inertial(inertial, masses.get(name)), "</link>"]
    lines += [_joint(*joint) for joint in bones.joints]
    return "\n".join([*lines, "</robot>"])


def principal(inertial: Inertial) -> tuple[Vector, Quat, Vector]:
    """Return the center of mass, the orientation of the principal axes, and the principal moments [kg·m²]."""
    ixx, ixy, ixz, iyy, iyz, izz = inertial.inertia
    pos, quat = from_pose(inertial.origin)
    if ixy == ixz == iyz == 0.0:
        return pos, quat, (ixx, iyy, izz)
    moments, axes = np.linalg.eigh(np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]))
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])  # right-handed
    w, x, y, z = quat_from_matrix(matrix_from_quat(inertial.origin.quat_wxyz) @ axes).tolist()
    return pos, (x, y, z, w), tuple(moments.tolist())


def _inertial(inertial: Inertial, mass: float | None = None) -> str:
    pos, quat, moments = principal(inertial)
    share = mass / inertial.mass if mass is not None and inertial.mass > 0.0 else 1.0
    ixx, iyy, izz = (share * moment for moment in moments)
    return (
        f'<inertial>{_origin((pos, quat))}<mass value="{share * inertial.mass!r}"/>'
        f'<inertia ixx="{ixx!r}" ixy="0" ixz="0" iyy="{iyy!r}" iyz="0" izz="{izz!r}"/></inertial>'
    )


def _joint(joint: Joint, parent: str, origin: tuple[Vector, Quat]) -> str:
    limits, kind = position_range(joint), joint.type.value
    if limits is None:
        lower, upper = 1.0, -1.0  # Bullet treats an empty range as unlimited
        kind = "continuous" if joint.type is JointType.REVOLUTE else kind
    else:
        net = NET[joint.type]
        lower, upper = limits[0] - net, limits[1] + net
    return (
        f'<joint name={quoteattr(joint.name)} type="{kind}"><parent link={quoteattr(parent)}/>'
        f'<child link={quoteattr(joint.child)}/>{_origin(origin)}<axis xyz="{_numbers(joint.axis)}"/>'
        f'<limit lower="{float(lower)!r}" upper="{float(upper)!r}" effort="0" velocity="0"/></joint>'
    )


def _solids(geometry: Geometry, meshes: MeshFiles) -> list[str]:
    """Return the contents of a shape's <geometry> elements, with one element per convex piece of a mesh."""
    if isinstance(geometry, Mesh):
        return [_mesh(path) for path in meshes.hulls(geometry)]
    return [_geometry(geometry)]


def _collision(inner: str, shape: Collision) -> str:
    return f"<collision>{_origin(from_pose(shape.origin))}<geometry>{inner}</geometry></collision>"


def _visuals(shape: Visual | Collision, meshes: MeshFiles) -> list[str]:
    """Return a shape's <visual> elements, with one element per color of a mesh."""
    geometry, rgba = shape.geometry, getattr(shape, "rgba", None) or _GREY
    if isinstance(geometry, Mesh):
        parts = [(_mesh(path), own or rgba) for path, own in meshes.drawn(geometry)]
    else:
        parts = [(_geometry(geometry), rgba)]
    origin = _origin(from_pose(shape.origin))
    return [
        f'<visual>{origin}<geometry>{inner}</geometry><material name="{_numbers(colour)}">'
        f'<color rgba="{_numbers(colour)}"/></material></visual>'
        for inner, colour in parts
    ]


def _mesh(path: Path) -> str:
    return f"<mesh filename={quoteattr(str(path))}/>"


def _geometry(geometry: Geometry) -> str:
    match geometry:
        case Box(size):
            return f'<box size="{_numbers(size)}"/>'
        case Sphere(radius):
            return f'<sphere radius="{float(radius)!r}"/>'
        case Cylinder(radius, length):
            return f'<cylinder radius="{float(radius)!r}" length="{float(length)!r}"/>'
        case Capsule(radius, length):
            return f'<capsule radius="{float(radius)!r}" length="{float(length)!r}"/>'
    raise TypeError(f"{geometry} cannot be written as a shape")


def _origin(transform: tuple[Vector, Quat]) -> str:
    return f'<origin xyz="{_numbers(transform[0])}" rpy="{_numbers(rpy_from_quat(transform[1]))}"/>'


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)
