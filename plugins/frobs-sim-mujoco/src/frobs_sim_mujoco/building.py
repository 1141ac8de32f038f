"""Builds a MuJoCo model from robots and a scene."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from types import MappingProxyType

import mujoco

from frobs_core.description import Placement, Scene
from frobs_core.util.errors import ModelFileError
from frobs_sim_mujoco.articulation import add_drives, add_robot, attach_mjcf
from frobs_sim_mujoco.contacts import add_contact
from frobs_sim_mujoco.geoms import ROBOT_GROUPS, set_friction
from frobs_sim_mujoco.looks import add_distractors, add_patterns
from frobs_sim_mujoco.meshes import Meshes
from frobs_sim_mujoco.options import Options
from frobs_sim_mujoco.overlaps import overlaps_at_home
from frobs_sim_mujoco.scenery import (
    add_attachment,
    add_body,
    add_camera,
    add_floor,
    light_up,
    show_far,
)
from frobs_sim_mujoco.wrenches import add_force_torque_sensors


def build_model(
    robots: Mapping[str, Placement],
    scene: Scene,
    physics_timestep: float,
    *,
    visuals: bool,
    overlaps: bool = False,
    spare: bool = False,
    options: Options = MappingProxyType({}),
) -> tuple[mujoco.MjModel, mujoco.MjSpec]:
    """Compile a MuJoCo model that contains robots and a scene, and return it with its specification.

    Links become bodies named ``robot/link``. Joints and their actuators are named ``robot/joint``. Scene bodies,
    cameras and contact sensors have the same names as in the scene.

    Args:
        robots: Robots, by name.
        scene: The rest of the scene.
        physics_timestep: [s]
        visuals: Whether to include visual shapes. Without visual shapes, the model has the same state variables and
            is faster to simulate.
        overlaps: Whether links that overlap in the home position can collide. The convex hulls of neighboring links
            often overlap. If such links could collide, the robot could not be controlled.
        spare: Whether to include patterns of the floor and hidden objects, which the looks of an environment can show.
        options: Values of ``mjOption`` fields that replace MuJoCo's defaults, by field name.

    Returns:
        The compiled model, and the specification that it was compiled from.

    Raises:
        ModelFileError: MuJoCo rejects a robot's model, or a mesh cannot be read.
        ConfigurationError: The scene is inconsistent.
    """
    scene.check(robots)
    spec = mujoco.MjSpec()
    spec.option.timestep = physics_timestep
    spec.option.integrator = _integrator(scene)
    spec.option.gravity = scene.gravity
    for field, value in options.items():
        setattr(spec.option, field, value)
    spec.compiler.degree = False
    spec.compiler.autolimits = False
    spec.compiler.balanceinertia = False
    light_up(spec)
    if scene.floor:
        add_floor(spec, scene)
    if spare:
        add_patterns(spec)
        add_distractors(spec)
    meshes = Meshes(spec)
    for name, body in scene.bodies.items():
        add_body(spec, meshes, name, body, hard=scene.hard_contacts)
    for number, (name, placement) in enumerate(robots.items()):
        group = ROBOT_GROUPS[min(number, len(ROBOT_GROUPS) - 1)]
        if placement.model.format == "mjcf":
            attach_mjcf(spec, name, placement, group, visuals)
        else:
            add_robot(spec, name, placement, group, visuals)
        for link, friction in placement.robot.friction.items():
            set_friction(spec, f"{name}/{link}", friction)
        for joint, armature in placement.armatures.items():
            spec.joint(f"{name}/{joint}").armature = armature
        add_drives(spec, name, placement)
        add_force_torque_sensors(spec, name, placement)
        if not placement.robot.self_collision:
            bodies = [side for link in placement.model.links if spec.body(side := f"{name}/{link.name}")]
            # A link between two joints of the same MJCF body has no MuJoCo body and is therefore not in ``bodies``.
            for first, second in combinations(bodies, 2):
                spec.add_exclude(bodyname1=first, bodyname2=second)
    for name, attachment in scene.attachments.items():
        add_attachment(spec, name, attachment, scene.attachment_pose(name, robots))
    for name, camera in scene.cameras.items():
        add_camera(spec, name, camera)
    for name, contact in scene.contacts.items():
        add_contact(spec, name, contact, robots, scene)
    model = _compile(spec, scene, robots)
    pairs = [] if overlaps else overlaps_at_home(model, robots)
    for first, second in pairs:
        spec.add_exclude(bodyname1=first, bodyname2=second)
    return _compile(spec, scene, robots) if pairs else model, spec


def _integrator(scene: Scene) -> mujoco.mjtIntegrator:
    """Return the integrator for a scene.

    ``implicitfast`` computes contact forces as if the drives had no implicit damping. If a robot with strong drives
    touches a light object, the object is pushed away too fast. ``discrete`` takes the drives into account.
    """
    return mujoco.mjtIntegrator.mjINT_DISCRETE if scene.hard_contacts else mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def _compile(spec: mujoco.MjSpec, scene: Scene, robots: Mapping[str, Placement]) -> mujoco.MjModel:
    try:
        model = spec.compile()
    except ValueError as error:
        paths = ", ".join(str(placement.model.path) for placement in robots.values())
        raise ModelFileError(paths, f"MuJoCo rejects the model: {' '.join(str(error).split())}") from error
    show_far(model, scene)
    return model
