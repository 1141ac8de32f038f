"""Adds robots to a MuJoCo model as bodies, joints and actuators, from parsed robot models or from MJCF files."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree

import mujoco
import numpy as np

from frobs_core.contracts import active_gains
from frobs_core.description import Placement
from frobs_core.models import Inertial, Joint, JointType, inertia_matrix
from frobs_core.util.errors import ModelFileError
from frobs_models import joints_below
from frobs_sim_mujoco.geoms import VISUAL_GROUP, add_shape
from frobs_sim_mujoco.meshes import Meshes

_JOINT_TYPES = {
    JointType.REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.CONTINUOUS: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE,
}
_OF_THE_SIMULATION = ("option", "size", "statistic", "visual")
"""Sections of an MJCF file that are ignored because they describe the simulation and not the robot."""
HARD = (0.99, 0.999, 0.001, 0.5, 2.0)
"""Impedance (``solimp``) of joint limits and equality constraints.

Together with a time constant of two timesteps, this impedance makes the constraints as hard as MuJoCo allows. With
MuJoCo's default time constant of 20 ms, strong drives would exceed joint limits by several degrees, and mimic joints
would lag behind their leaders.
"""


def add_robot(spec: mujoco.MjSpec, name: str, placement: Placement, group: int, visuals: bool) -> None:
    """Add a robot's bodies, joints and shapes to a specification.

    Raises:
        ModelFileError: A joint cannot be simulated, or a mesh cannot be read.
    """
    model, robot = placement.model, placement.robot
    children = joints_below(model)
    links = {link.name: link for link in model.links}
    fixed = robot.base == "fixed"
    root = spec.worldbody.add_body(
        name=f"{name}/{model.root}", pos=placement.pose.pos, quat=placement.pose.quat_wxyz, mocap=fixed
    )
    if fixed and "floor" in (geom.name for geom in spec.geoms):
        spec.add_exclude(bodyname1="world", bodyname2=f"{name}/{model.root}")
    if not fixed:
        root.add_freejoint(name=f"{name}/base")

    meshes = Meshes(spec)
    waiting = [(root, model.root)]  # no recursion, because a robot's chain of links may exceed Python's recursion limit
    while waiting:
        element, link_name = waiting.pop()
        link = links[link_name]
        if link.inertial is not None:
            element.explicitinertial = True
            set_inertia(element, link.inertial)
        else:
            remove_mass(element)
        for collision in link.collisions:
            for geom in add_shape(meshes, element, collision.geometry, collision.origin, group, None, collides=True):
                geom.mass = 0.0  # only the file's inertial elements contribute mass
        for visual in (link.visuals or link.collisions) if visuals else ():
            rgba = getattr(visual, "rgba", None)
            add_shape(meshes, element, visual.geometry, visual.origin, VISUAL_GROUP, rgba, collides=False)
        below = []
        for joint in children.get(link_name, ()):
            child = element.add_body(name=f"{name}/{joint.child}", pos=joint.origin.pos, quat=joint.origin.quat_wxyz)
            _add_joint(spec, child, name, joint)
            below.append((child, joint.child))
        waiting += reversed(below)


def _add_joint(spec: mujoco.MjSpec, child: mujoco.MjsBody, robot: str, joint: Joint) -> None:
    if joint.type is JointType.FIXED:
        return
    element = child.add_joint(
        name=f"{robot}/{joint.name}",
        type=_JOINT_TYPES[joint.type],
        axis=joint.axis,
        damping=[joint.damping, 0, 0],
        frictionloss=joint.friction,
    )
    lower, upper = joint.limits.lower, joint.limits.upper
    if joint.type is not JointType.CONTINUOUS and np.isfinite([lower, upper]).all():
        element.limited, element.range = mujoco.mjtLimited.mjLIMITED_TRUE, (lower, upper)
        element.solref_limit, element.solimp_limit = (2.0 * spec.option.timestep, 1.0), HARD
    if joint.mimic is not None:
        spec.add_equality(
            solref=(2.0 * spec.option.timestep, 1.0),
            solimp=HARD,
            name=f"{robot}/{joint.name}",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=f"{robot}/{joint.name}",
            name2=f"{robot}/{joint.mimic.joint}",
            data=[joint.mimic.offset, joint.mimic.multiplier, *[0.0] * (int(mujoco.mjNEQDATA) - 2)],
        )


def set_inertia(element: mujoco.MjsBody, inertial: Inertial) -> None:
    """Set the mass, center of mass and inertia of a body."""
    inertia = inertia_matrix(inertial)
    element.mass, element.ipos = inertial.mass, inertial.origin.pos
    element.fullinertia = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]


def remove_mass(element: mujoco.MjsBody) -> None:
    """Set the mass of a body to 0, and its center of mass to its origin.

    MuJoCo places an undefined center of mass as far from the origin as the origin is from the parent body. Wrenches
    would act there.
    """
    element.explicitinertial, element.mass, element.ipos = True, 0.0, (0.0, 0.0, 0.0)


def add_drives(spec: mujoco.MjSpec, robot: str, placement: Placement) -> None:
    """Add an actuator that implements the drive law, effort = clip(ctrl + b1·q + b2·q̇), for each actuated joint."""
    stiffness, damping, _ = active_gains(placement.command_modes, *placement.drive_gains)
    for joint, kp, kd in zip(placement.model.actuated_joints, stiffness, damping, strict=True):
        limited = np.isfinite(joint.limits.effort)
        spec.add_actuator(
            name=f"{robot}/{joint.name}",
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=f"{robot}/{joint.name}",
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[1.0] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, -kp, -kd] + [0.0] * 7,
            forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE if limited else mujoco.mjtLimited.mjLIMITED_FALSE,
            forcerange=(-joint.limits.effort, joint.limits.effort) if limited else (0.0, 0.0),
        )


def attach_mjcf(spec: mujoco.MjSpec, name: str, placement: Placement, group: int, visuals: bool) -> None:
    """Attach the robot in an MJCF file, using the parsed model's joint names and omitting the file's actuators.

    If ``visuals`` is set, the collision shapes of bodies without visual shapes are drawn.
    """
    model = placement.model
    document = ElementTree.fromstring(model.xml)  # this XML contains all names, a single root body and absolute paths
    for section in _OF_THE_SIMULATION:
        for element in document.findall(section):
            document.remove(element)
    try:
        robot = mujoco.MjSpec.from_string(ElementTree.tostring(document, encoding="unicode"))
        if robot.compiler.settotalmass > 0.0:
            _fix_masses(robot)
    except ValueError as error:
        raise ModelFileError(model.path, f"MuJoCo rejects the file: {' '.join(str(error).split())}") from error
    for unwanted in (*robot.actuators, *robot.sensors, *robot.keys):
        robot.delete(unwanted)
    moving = [j for j in robot.joints if j.type in _JOINT_TYPES.values()]
    named = [j for j in model.joints if j.type in _JOINT_TYPES]
    for element, joint in zip(moving, named, strict=True):
        element.name = joint.name
    roots = list(_children(robot.worldbody))
    if len(roots) != 1:
        raise ModelFileError(model.path, f"a robot must have exactly one root body, but this file has {len(roots)}.")
    for joint in roots[0].joints:
        if joint.type == mujoco.mjtJoint.mjJNT_FREE:
            robot.delete(joint)
    for body in robot.bodies[1:]:
        if not body.explicitinertial and all(geom.mass == 0.0 for geom in body.geoms):
            remove_mass(body)
    for body in robot.bodies:
        colliding = [bool(geom.contype or geom.conaffinity) for geom in body.geoms]
        of_colliding = VISUAL_GROUP if visuals and all(colliding) else group
        for geom, collides in zip(body.geoms, colliding, strict=True):
            geom.group = of_colliding if collides else VISUAL_GROUP
    frame = spec.worldbody.add_frame()
    root = frame.attach_body(roots[0], f"{name}/", "")
    root.pos, root.quat = placement.pose.pos, placement.pose.quat_wxyz
    if placement.robot.base == "fixed":
        root.mocap = True
    else:
        root.add_freejoint(name=f"{name}/base")


def _fix_masses(robot: mujoco.MjSpec) -> None:
    """Scale a robot's masses and inertias to match ``settotalmass``, which MuJoCo only applies to a complete model."""
    total, robot.compiler.settotalmass = robot.compiler.settotalmass, -1.0
    compiled = robot.compile()
    share = total / compiled.body_subtreemass[0]
    robot.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for body in robot.bodies[1:]:
        i = body.id
        body.explicitinertial, body.mass = True, share * compiled.body_mass[i]
        body.ipos, body.iquat = compiled.body_ipos[i], compiled.body_iquat[i]
        body.inertia = share * compiled.body_inertia[i]
        body.fullinertia = [np.nan, 0.0, 0.0, 0.0, 0.0, 0.0]  # undefined


def _children(body: mujoco.MjsBody) -> Iterator[mujoco.MjsBody]:
    child = body.first_body()
    while child is not None:
        yield child
        child = body.next_body(child)
