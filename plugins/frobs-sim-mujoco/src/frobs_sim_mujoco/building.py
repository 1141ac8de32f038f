"""From robots and a scene to one MuJoCo model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

import mujoco
import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError, ModelFileError
from frobs_core.interfaces import Body, Camera, CommandMode, Contact, Placement, Scene
from frobs_core.models import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    JointType,
    Mesh,
    Pose,
    RobotModel,
    Sphere,
    default_gains,
    home_positions,
)
from frobs_core.rotations import matrix_from_quat
from frobs_sim_mujoco.meshes import RobotMeshes
from frobs_sim_mujoco.overlaps import overlaps_at_home

SCENE_GROUP = 0
"""Geom group of what the scene collides with: drawn, and seen by rays."""
VISUAL_GROUP = 1
"""Geom group of what is only drawn."""
ROBOT_GROUPS = (2, 3, 4, 5)
"""Geom groups of what each robot collides with: seen by rays, and left out of the robot's own."""

_JOINT_TYPES = {
    JointType.REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.CONTINUOUS: mujoco.mjtJoint.mjJNT_HINGE,
    JointType.PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE,
}
_HARD = (0.99, 0.999, 0.001, 0.5, 2.0)
"""Impedance of what holds joints, with a time constant of two timesteps: as hard as MuJoCo allows. Its default is a spring
of 20 ms, which a strong drive pushes in by degrees, and behind which a finger that follows another lags."""
_FRICTION = (0.005, 0.0001)  # torsional [m] and rolling [m]: MuJoCo's defaults


def build_model(
    robots: Mapping[str, Placement],
    scene: Scene,
    physics_timestep: float,
    *,
    visuals: bool,
    overlaps: bool = False,
) -> mujoco.MjModel:
    """Compile robots and a scene.

    Links become bodies named ``robot/link``, joints and their actuators ``robot/joint``, scene bodies, cameras and
    contact sensors keep their names.

    Args:
        robots: By name.
        scene: Everything else.
        physics_timestep: [s]
        visuals: Whether robots have what is only drawn. A model without it has the same states, and steps faster.
        overlaps: Whether links that are in each other at home push each other apart. Convex hulls of neighbours often
            are; a robot that begins with them cannot be controlled.

    Raises:
        ModelFileError: MuJoCo refuses a robot's model.
        ConfigurationError: The scene is contradictory.
    """
    spec = mujoco.MjSpec()
    spec.option.timestep = physics_timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = scene.gravity
    spec.compiler.degree = False
    spec.compiler.autolimits = False
    spec.compiler.balanceinertia = False
    _light_up(spec)
    if scene.floor:
        _add_floor(spec)
    for name, body in scene.bodies.items():
        _add_body(spec, name, body)
    for number, (name, placement) in enumerate(robots.items()):
        group = ROBOT_GROUPS[min(number, len(ROBOT_GROUPS) - 1)]
        if placement.model.format == "mjcf":
            _attach_mjcf(spec, name, placement, group)
        else:
            _add_robot(spec, name, placement, group, visuals)
        _add_drives(spec, name, placement)
        if not placement.robot.self_collision:
            bodies = [body for link in placement.model.links if spec.body(body := f"{name}/{link.name}")]
            for first, second in combinations(bodies, 2):  # the links between the joints of one MJCF body are no bodies
                spec.add_exclude(bodyname1=first, bodyname2=second)
    for name, camera in scene.cameras.items():
        _add_camera(spec, name, camera)
    for name, contact in scene.contacts.items():
        _add_contact(spec, name, contact, robots, scene)
    model = _compile(spec, robots)
    pairs = [] if overlaps else overlaps_at_home(model, robots)
    for first, second in pairs:
        spec.add_exclude(bodyname1=first, bodyname2=second)
    return _compile(spec, robots) if pairs else model


def _compile(spec: mujoco.MjSpec, robots: Mapping[str, Placement]) -> mujoco.MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        paths = ", ".join(str(placement.model.path) for placement in robots.values())
        raise ModelFileError(paths, f"MuJoCo refuses the model: {' '.join(str(error).split())}") from error


def drive_gains(placement: Placement) -> tuple[np.ndarray, np.ndarray]:
    """Return Kp and Kd of a robot's joints, (dof,) each."""
    model, robot = placement.model, placement.robot
    gains = robot.gains or default_gains(model, home_positions(model, robot.home))
    pairs = [gains.of(joint) for joint in model.joint_names]
    return np.array([kp for kp, _ in pairs]), np.array([kd for _, kd in pairs])


def drive_bias(mode: CommandMode, stiffness: Floats, damping: Floats) -> Floats:
    """Return the actuators' (b1, b2) that realise the drive law in a command mode, (…, dof, 2)."""
    held = float(mode is CommandMode.POSITION), float(mode is not CommandMode.EFFORT)
    return np.stack([-held[0] * stiffness, -held[1] * damping], axis=-1)


def _light_up(spec: mujoco.MjSpec) -> None:
    """Make pictures pleasant: a sky, soft light, enough room for the frame."""
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.86, 0.91, 0.96),
        rgb2=(0.55, 0.65, 0.76),
        width=64,
        height=384,
    )
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1440
    spec.visual.quality.shadowsize = 4096
    spec.visual.headlight.ambient = (0.35, 0.35, 0.35)
    spec.visual.headlight.diffuse = (0.35, 0.35, 0.35)
    spec.visual.headlight.specular = (0.05, 0.05, 0.05)
    spec.worldbody.add_light(
        pos=(1.5, -1.5, 3.5),
        dir=(-0.38, 0.38, -0.85),
        diffuse=(0.6, 0.6, 0.6),
        specular=(0.15, 0.15, 0.15),
        castshadow=True,
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
    )


def _add_floor(spec: mujoco.MjSpec) -> None:
    spec.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=(0.78, 0.80, 0.82),
        rgb2=(0.72, 0.74, 0.77),
        width=512,
        height=512,
    )
    material = spec.add_material(name="floor", texrepeat=(4, 4), texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0, 0, 0.05),
        material="floor",
        group=SCENE_GROUP,
        friction=(1.0, *_FRICTION),
    )


def _add_body(spec: mujoco.MjSpec, name: str, body: Body) -> None:
    if body.mass is not None and body.kinematic:
        raise ConfigurationError(f"scene body '{name}' is kinematic, so it has no mass; give one or the other.")
    element = spec.worldbody.add_body(name=name, pos=body.pose.pos, quat=body.pose.quat_wxyz, mocap=body.kinematic)
    if body.mass is not None:
        element.add_freejoint(name=name)
    group = SCENE_GROUP if body.collides else VISUAL_GROUP
    geom = _add_geom(element, body.geometry, Pose(), group, body.rgba, collides=body.collides)
    geom.name = name
    geom.friction = (body.friction, *_FRICTION)
    if body.mass is not None:
        geom.mass = body.mass


def _add_robot(spec: mujoco.MjSpec, name: str, placement: Placement, group: int, visuals: bool) -> None:
    model, robot = placement.model, placement.robot
    children: dict[str, list[Joint]] = {}
    for joint in model.joints:
        children.setdefault(joint.parent, []).append(joint)
    links = {link.name: link for link in model.links}
    fixed = robot.base == "fixed"
    root = spec.worldbody.add_body(
        name=f"{name}/{model.root}", pos=placement.pose.pos, quat=placement.pose.quat_wxyz, mocap=fixed
    )
    if fixed and "floor" in (geom.name for geom in spec.geoms):
        spec.add_exclude(bodyname1="world", bodyname2=f"{name}/{model.root}")
    if not fixed:
        root.add_freejoint(name=f"{name}/base")

    meshes = RobotMeshes(spec)
    waiting = [(root, model.root)]  # no recursion: a robot may be deeper than Python's stack
    while waiting:
        element, link_name = waiting.pop()
        link = links[link_name]
        element.explicitinertial = link.inertial is not None
        if link.inertial is not None:
            _set_inertia(element, link.inertial)
        for collision in link.collisions:
            for geom in _add_shape(meshes, element, collision.geometry, collision.origin, group, None, collides=True):
                geom.mass = 0.0  # what the file does not weigh, weighs nothing
        for visual in (link.visuals or link.collisions) if visuals else ():
            rgba = getattr(visual, "rgba", None)
            _add_shape(meshes, element, visual.geometry, visual.origin, VISUAL_GROUP, rgba, collides=False)
        below = []
        for joint in children.get(link_name, ()):
            child = element.add_body(name=f"{name}/{joint.child}", pos=joint.origin.pos, quat=joint.origin.quat_wxyz)
            _add_joint(spec, child, name, joint, model)
            below.append((child, joint.child))
        waiting += reversed(below)


def _add_joint(spec: mujoco.MjSpec, child: mujoco.MjsBody, robot: str, joint: Joint, model: RobotModel) -> None:
    if joint.type is JointType.FIXED:
        return
    if joint.type not in _JOINT_TYPES:
        raise ModelFileError(
            model.path,
            f"joint '{joint.name}' is {joint.type.value}; only revolute, continuous, prismatic and "
            "fixed joints can be simulated. For a free base, say base='floating' in the robot's description.",
        )
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
        element.solref_limit, element.solimp_limit = (2.0 * spec.option.timestep, 1.0), _HARD
    if joint.mimic is not None:
        spec.add_equality(
            solref=(2.0 * spec.option.timestep, 1.0),
            solimp=_HARD,
            name=f"{robot}/{joint.name}",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=f"{robot}/{joint.name}",
            name2=f"{robot}/{joint.mimic.joint}",
            data=[joint.mimic.offset, joint.mimic.multiplier, *[0.0] * (int(mujoco.mjNEQDATA) - 2)],
        )


def _add_drives(spec: mujoco.MjSpec, robot: str, placement: Placement) -> None:
    """Add an actuator for each joint: effort = clip(ctrl + b1·q + b2·q̇), which is the drive law."""
    bias = drive_bias(placement.command_mode, *drive_gains(placement))
    for joint, (b1, b2) in zip(placement.model.actuated_joints, bias, strict=True):
        limited = np.isfinite(joint.limits.effort)
        spec.add_actuator(
            name=f"{robot}/{joint.name}",
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=f"{robot}/{joint.name}",
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[1.0] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, b1, b2] + [0.0] * 7,
            forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE if limited else mujoco.mjtLimited.mjLIMITED_FALSE,
            forcerange=(-joint.limits.effort, joint.limits.effort) if limited else (0.0, 0.0),
        )


def _set_inertia(element: mujoco.MjsBody, inertial: Inertial) -> None:
    ixx, ixy, ixz, iyy, iyz, izz = inertial.inertia
    rotation = matrix_from_quat(np.array(inertial.origin.quat_wxyz))
    inertia = rotation @ np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]) @ rotation.T
    element.mass, element.ipos = inertial.mass, inertial.origin.pos
    element.fullinertia = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]


def _add_shape(
    meshes: RobotMeshes,
    element: mujoco.MjsBody,
    geometry: Geometry,
    origin: Pose,
    group: int,
    rgba: tuple[float, float, float, float] | None,
    *,
    collides: bool,
) -> list[mujoco.MjsGeom]:
    """Add a shape of a robot: one geom, or for the visual of a mesh one for each of its colours."""
    if not isinstance(geometry, Mesh):
        return [_add_geom(element, geometry, origin, group, rgba, collides=collides)]
    geoms = []
    for name, own_rgba in meshes.hull(geometry) if collides else meshes.drawn(geometry):
        geom = _add_plain_geom(element, origin, group, own_rgba or rgba, collides=collides)
        geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, name
        geoms.append(geom)
    return geoms


def _add_geom(
    element: mujoco.MjsBody,
    geometry: Geometry,
    origin: Pose,
    group: int,
    rgba: tuple[float, float, float, float] | None,
    *,
    collides: bool,
) -> mujoco.MjsGeom:
    geom = _add_plain_geom(element, origin, group, rgba, collides=collides)
    match geometry:
        case Box(size):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_BOX, [edge / 2 for edge in size]
        case Sphere(radius):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_SPHERE, [radius, 0, 0]
        case Cylinder(radius, length):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_CYLINDER, [radius, length / 2, 0]
        case Capsule(radius, length):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_CAPSULE, [radius, length / 2, 0]
        case Mesh(path):
            raise ConfigurationError(
                f"the mesh {path} is no shape of a scene: boxes, spheres, cylinders, capsules are."
            )
    return geom


def _add_plain_geom(
    element: mujoco.MjsBody,
    origin: Pose,
    group: int,
    rgba: tuple[float, float, float, float] | None,
    *,
    collides: bool,
) -> mujoco.MjsGeom:
    """Add a geom that has all but its shape."""
    geom = element.add_geom(pos=origin.pos, quat=origin.quat_wxyz, group=group)
    geom.contype = geom.conaffinity = int(collides)
    geom.rgba = rgba or (0.7, 0.7, 0.72, 1.0)
    if not collides:
        geom.mass = 0.0
    return geom


def _attach_mjcf(spec: mujoco.MjSpec, name: str, placement: Placement, group: int) -> None:
    """Attach a robot from its own MJCF file, with the core's names and without its actuators."""
    model = placement.model
    try:
        robot = mujoco.MjSpec.from_string(model.xml)  # names filled in, one root body, absolute paths
    except ValueError as error:
        raise ModelFileError(model.path, f"MuJoCo refuses the file: {' '.join(str(error).split())}") from error
    for unwanted in (*robot.actuators, *robot.sensors, *robot.keys):
        robot.delete(unwanted)
    moving = [j for j in robot.joints if j.type in _JOINT_TYPES.values()]
    named = [j for j in model.joints if j.type in _JOINT_TYPES]
    for element, joint in zip(moving, named, strict=True):
        element.name = joint.name
    roots = list(_children(robot.worldbody))
    if len(roots) != 1:
        raise ModelFileError(model.path, f"a robot has one root body; this file has {len(roots)}.")
    for joint in roots[0].joints:
        if joint.type == mujoco.mjtJoint.mjJNT_FREE:
            robot.delete(joint)
    for geom in robot.geoms:
        geom.group = group if geom.contype or geom.conaffinity else VISUAL_GROUP
    frame = spec.worldbody.add_frame()
    root = frame.attach_body(roots[0], f"{name}/", "")
    root.pos, root.quat = placement.pose.pos, placement.pose.quat_wxyz
    if placement.robot.base == "fixed":
        root.mocap = True
    else:
        root.add_freejoint(name=f"{name}/base")


def _children(body: mujoco.MjsBody) -> Iterator[mujoco.MjsBody]:
    child = body.first_body()
    while child is not None:
        yield child
        child = body.next_body(child)


def _add_camera(spec: mujoco.MjSpec, name: str, camera: Camera) -> None:
    parent = spec.worldbody if camera.frame is None else spec.body(camera.frame)
    if parent is None:
        raise ConfigurationError(f"camera '{name}' is fixed to '{camera.frame}', which is no body of the scene.")
    back = np.subtract(camera.pos, camera.target)
    back = back / np.linalg.norm(back)
    up = np.array([0.0, 1.0, 0.0]) if abs(back[2]) > 0.999 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.stack([right, np.cross(back, right), back], axis=1).reshape(9))
    parent.add_camera(name=name, pos=camera.pos, quat=quat, fovy=camera.fov_y)


def _add_contact(
    spec: mujoco.MjSpec, name: str, contact: Contact, robots: Mapping[str, Placement], scene: Scene
) -> None:
    """Add a contact sensor: data found and force, of the one contact with the largest force."""

    def side(which: str) -> tuple[mujoco.mjtObj, str]:
        if which == "*":
            return mujoco.mjtObj.mjOBJ_UNKNOWN, ""
        if which == "floor" and scene.floor:
            return mujoco.mjtObj.mjOBJ_GEOM, which
        if which in robots:
            return mujoco.mjtObj.mjOBJ_XBODY, f"{which}/{robots[which].model.root}"  # the whole subtree
        if spec.body(which) is None:
            known = [*scene.bodies, *robots, *(["floor"] if scene.floor else [])]
            raise ConfigurationError(f"contact '{name}' names '{which}', which is none of {', '.join(known)}.")
        return mujoco.mjtObj.mjOBJ_BODY, which

    (first_type, first), (second_type, second) = side(contact.first), side(contact.second)
    spec.add_sensor(
        name=name,
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=first_type,
        objname=first,
        reftype=second_type,
        refname=second,
        intprm=[3, 2, 1],  # bits found | force; reduced by the largest force; one slot
    )
