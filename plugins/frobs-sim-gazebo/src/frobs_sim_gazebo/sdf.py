"""Converts robots, scene bodies and the floor to SDF models that Gazebo can spawn."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from frobs_core.description import Body, Placement
from frobs_core.models import Inertial, JointType, compose, inertia_matrix, pose_array
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_core.util.rotations import rpy_from_quat
from frobs_sim_gazebo.meshes import MeshFiles
from frobs_sim_gazebo.shapes import elements, numbers
from frobs_sim_gazebo.skeleton import Mass, Skeleton

LINK = "link"
"""Name of the link in a scene body's model."""

_OPEN = 1e16  # effectively unlimited, because the plugin enforces the joint limits
# Contact stiffness [N/m] and damping [N s/m]. If contacts were rigid, they would not share loads, and casters would
# lift wheels off the floor.
_STIFFNESS, _DAMPING = 1e7, 1e3
_STANDING = 1.0  # [kg] mass of a fixed base
_UNTURNED = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def safe_names(names: Iterable[str]) -> dict[str, str]:
    """Return a unique valid SDF name for each of the given names."""
    safe: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_.-]", "_", name) or "_"
        while plain in safe.values() or plain == "world":
            plain += "_"
        safe[name] = plain
    return safe


def floor_sdf(name: str, friction: float) -> str:
    """Return the SDF model of a floor at z = 0 with one shape, which is named ``0``."""
    plane = "<plane><normal>0 0 1</normal><size>100 100</size></plane>"
    link = f'<link name="{LINK}">{_collision("0", plane, _UNTURNED, friction)}</link>'
    return _model(name, _UNTURNED, f"<static>1</static>{link}")


def body_sdf(name: str, body: Body, meshes: MeshFiles) -> tuple[str, list[str]]:
    """Return the SDF model of a scene body, and the names of the body's shapes.

    Raises:
        ModelFileError: A mesh cannot be read.
    """
    parts = [
        (xml, compose(pose_array(shape.origin), pose_array(pose)))
        for shape in body.collisions
        for xml, pose in elements(shape.geometry, meshes)
    ]
    shapes = [
        _collision(str(i), xml, place, body.friction, body.torsional_friction) for i, (xml, place) in enumerate(parts)
    ]
    static = "<static>1</static>" if body.inertial is None else ""
    mass = "" if body.inertial is None else _inertial(_mass(body.inertial))
    inner = f'{static}<link name="{LINK}">{mass}{"".join(shapes)}</link>'
    return _model(name, pose_array(body.pose), inner), [str(i) for i in range(len(shapes))]


def _mass(inertial: Inertial) -> Mass:
    return Mass(inertial.mass, np.array(inertial.origin.pos), inertia_matrix(inertial))


def robot_sdf(name: str, placement: Placement, bones: Skeleton, meshes: MeshFiles) -> tuple[str, dict[str, list[str]]]:
    """Return the SDF model of a robot with all joints at 0, and the names of each link's shapes.

    Links that are fixed together become one link, which is named after the first of these links. A fixed base becomes a
    kinematic link.

    Raises:
        ModelFileError: A mesh cannot be read, or a free base has no mass.
    """
    model, robot = placement.model, placement.robot
    links = safe_names(bones.bodies)
    joints = safe_names(joint.name for joint in bones.joints)
    masses = bones.masses()
    fixed = robot.base == "fixed"
    if not fixed and masses[0].mass <= 0.0:
        raise ModelFileError(model.path, f"the root link '{model.root}' has no mass, but a movable base requires mass.")
    if fixed:  # centered at the origin, because Gazebo ignores a fixed base's center of mass
        masses[0] = Mass(_STANDING, np.zeros(3), _STANDING * np.eye(3))
    collisions: list[list[str]] = [[] for _ in bones.bodies]
    shapes: dict[str, list[str]] = {}
    for link in model.links:
        body, offset = bones.frames[link.name]
        for shape in link.collisions:
            place = compose(offset, pose_array(shape.origin))
            for xml, pose in elements(shape.geometry, meshes):
                own = f"{len(collisions[body])}"
                friction = robot.friction.get(link.name, 1.0)
                collisions[body].append(_collision(own, xml, compose(place, pose_array(pose)), friction))
                shapes.setdefault(link.name, []).append(own)
    pos, quat, _ = bones.place(_UNTURNED[None], np.zeros((1, len(bones.joints))))
    lines = ["<self_collide>1</self_collide>" if robot.self_collision else ""]
    for body, link_name in enumerate(bones.bodies):
        place = np.concatenate([pos[0, body], quat[0, body]])
        kinematic = "<kinematic>1</kinematic>" if fixed and body == 0 else ""
        lines.append(
            f'<link name="{links[link_name]}">{_pose(place)}{_inertial(masses[body])}{kinematic}'
            f"{''.join(collisions[body])}</link>"
        )
    for j, joint in enumerate(bones.joints):
        kind = "prismatic" if joint.type is JointType.PRISMATIC else "revolute"
        lines.append(
            f'<joint name="{joints[joint.name]}" type="{kind}"><parent>{links[bones.bodies[bones.parents[j]]]}</parent>'
            f"<child>{links[bones.bodies[j + 1]]}</child><axis><xyz>{numbers(joint.axis)}</xyz>"
            f"<limit><lower>{-_OPEN}</lower><upper>{_OPEN}</upper></limit></axis></joint>"
        )
    return _model(name, pose_array(placement.pose), "".join(lines)), shapes


def _model(name: str, place: Floats, inner: str) -> str:
    return (
        f'<sdf version="1.6"><model name="{name}">{_pose(place)}'
        f"<allow_auto_disable>0</allow_auto_disable>{inner}</model></sdf>"
    )


def _collision(name: str, geometry: str, place: Floats, friction: float, torsional: float = 0.0) -> str:
    mu = float(friction)
    twist = ""
    if torsional > 0.0:  # ODE's maximum torque per normal force is 3π/16 · coefficient · radius
        twist = (
            f"<torsional><coefficient>1</coefficient><patch_radius>{16.0 * torsional / (3.0 * np.pi)!r}</patch_radius>"
            "</torsional>"
        )
    return (
        f'<collision name="{name}">{_pose(place)}<max_contacts>20</max_contacts><geometry>{geometry}</geometry>'
        f"<surface><friction><ode><mu>{mu!r}</mu><mu2>{mu!r}</mu2></ode>{twist}</friction>"
        f"<contact><ode><kp>{_STIFFNESS!r}</kp><kd>{_DAMPING!r}</kd></ode></contact></surface></collision>"
    )


def _inertial(mass: Mass) -> str:
    (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = mass.inertia.tolist()
    return (
        f"<inertial><pose>{numbers(mass.com)} 0 0 0</pose><mass>{mass.mass!r}</mass><inertia><ixx>{ixx!r}</ixx>"
        f"<ixy>{ixy!r}</ixy><ixz>{ixz!r}</ixz><iyy>{iyy!r}</iyy><iyz>{iyz!r}</iyz><izz>{izz!r}</izz></inertia></inertial>"
    )


def _pose(place: Floats) -> str:
    return f"<pose>{numbers(place[:3])} {numbers(rpy_from_quat(place[3:]))}</pose>"
