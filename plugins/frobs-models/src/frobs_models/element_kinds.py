"""Kinds of elements in a model file, with the links and joints that contain such elements."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from frobs_core.models import Geometry, JointType, Mesh, RobotModel
from frobs_models.mjcf.document import MjcfDocument
from frobs_models.xmltree import Element, parse_xml

ELEMENTS: Mapping[str, str] = {
    "inertias": "mass, center of mass and moments of inertia of a link",
    "visual_shapes": "boxes, spheres, cylinders and capsules that are only rendered",
    "visual_meshes": "meshes that are only rendered",
    "colours": "colors of visuals",
    "textures": "images on visuals",
    "collision_shapes": "boxes, spheres, cylinders and capsules that collide",
    "collision_meshes": "meshes that collide",
    "contact_parameters": "friction, stiffness and similar parameters of a link",
    "moving_joints": "revolute, continuous and prismatic joints",
    "fixed_joints": "joints that do not move",
    "other_joints": "floating and planar joints",
    "position_limits": "lower and upper limits of joints",
    "velocity_limits": "maximum velocities of joints",
    "effort_limits": "maximum efforts of joints",
    "joint_damping": "friction proportional to a joint's velocity",
    "joint_friction": "dry friction of joints",
    "joint_springs": "springs of joints, and their rest positions",
    "armatures": "inertia of the motors behind the gears",
    "gravity_compensation": "bodies with reduced gravity",
    "mimic_joints": "joints that follow another",
    "safety_controllers": "soft limits for controllers",
    "calibrations": "reference positions of joints",
    "transmissions": "gears between motors and joints",
    "ros2_control": "hardware interfaces of ROS 2",
    "gazebo_tags": "elements that only Gazebo uses",
    "mujoco_tags": "elements that only MuJoCo uses",
    "sensors": "sensors in the file",
    "actuators": "actuators in the file",
    "tendons": "cables over joints and sites",
    "equalities": "constraints between bodies or joints",
    "contact_pairs": "pairs of bodies that always or never collide",
    "keyframes": "named states",
    "sites": "points of interest on a body",
    "cameras": "cameras in the file",
    "lights": "lights in the file",
    "world_geoms": "shapes that belong to the world, such as a floor",
    "options": "settings of the engine: timestep, gravity, solver",
    "unknown_elements": "elements that the format does not define",
}
"""All kinds of elements with their meanings."""


_BESIDE = {  # children of a URDF's <robot> that do not belong to a link or joint
    "transmission": "transmissions",
    "ros2_control": "ros2_control",
    "gazebo": "gazebo_tags",
    "mujoco": "mujoco_tags",
    "sensor": "sensors",
}
_SECTIONS = {  # sections of an MJCF file; each section contains elements of one kind
    "actuator": "actuators",
    "sensor": "sensors",
    "tendon": "tendons",
    "contact": "contact_pairs",
    "keyframe": "keyframes",
}
_IN_BODIES = {"site": "sites", "camera": "cameras", "light": "lights"}


def elements(model: RobotModel) -> dict[str, tuple[str, ...]]:
    """Return the kinds of elements in a model, in the order of ``ELEMENTS``.

    Simulators must account for each kind in ``Simulation.translation``.

    Returns:
        For each kind, the unique names of the links or joints that contain such an element, in file order. An element
        that does not belong to a link or joint is listed by its name, or by its tag if it has no name.
    """
    names: dict[str, dict[str, None]] = {}
    root = parse_xml(model.xml, model.path, expanded=True)
    pairs = [
        *_joints(model),
        *(_urdf(model, root) if model.format == "urdf" else _mjcf(MjcfDocument(root, model.path))),
    ]
    for kind, name in pairs:
        names.setdefault(kind, {})[name] = None
    return {kind: tuple(names[kind]) for kind in ELEMENTS if kind in names}


def _joints(model: RobotModel) -> Iterator[tuple[str, str]]:
    for joint in model.joints:
        if joint.type is JointType.FIXED:
            yield "fixed_joints", joint.name
            continue
        if joint.type in (JointType.FLOATING, JointType.PLANAR):
            yield "other_joints", joint.name
            continue
        yield "moving_joints", joint.name
        if math.isfinite(joint.limits.lower) or math.isfinite(joint.limits.upper):
            yield "position_limits", joint.name
        if math.isfinite(joint.limits.velocity):
            yield "velocity_limits", joint.name
        if math.isfinite(joint.limits.effort):
            yield "effort_limits", joint.name
        if joint.damping:
            yield "joint_damping", joint.name
        if joint.friction:
            yield "joint_friction", joint.name
        if joint.mimic:
            yield "mimic_joints", joint.name


def _urdf(model: RobotModel, root: Element) -> Iterator[tuple[str, str]]:
    for link in model.links:
        if link.inertial is not None:
            yield "inertias", link.name
        for visual in link.visuals:
            yield _shape_kind("visual", visual.geometry), link.name
            if visual.rgba is not None:
                yield "colours", link.name
        for collision in link.collisions:
            yield _shape_kind("collision", collision.geometry), link.name
    textured = {m.get("name") for m in root.children("material") if m.child("texture") is not None}
    for element in root.children():
        name = element.get("name") or element.get("reference") or f"<{element.tag}>"
        if element.tag == "link":
            yield from _link_extras(element, name, textured)
        elif element.tag == "joint":
            for tag, kind in (("safety_controller", "safety_controllers"), ("calibration", "calibrations")):
                if element.child(tag) is not None:
                    yield kind, name
        elif element.tag != "material":
            yield _BESIDE.get(element.tag, "unknown_elements"), name


def _shape_kind(role: str, geometry: Geometry) -> str:
    return f"{role}_meshes" if isinstance(geometry, Mesh) else f"{role}_shapes"


def _link_extras(link: Element, name: str, textured: set[str | None]) -> Iterator[tuple[str, str]]:
    if link.child("contact") is not None:
        yield "contact_parameters", name
    if link.child("sensor") is not None:
        yield "sensors", name
    for material in link.descendants("material"):
        if material.child("texture") is not None or material.get("name") in textured:
            yield "textures", name


def _mjcf(document: MjcfDocument) -> Iterator[tuple[str, str]]:
    root = document.root
    for section, kind in _SECTIONS.items():
        for child in document.children(of=section):
            yield kind, child.get("name") or f"<{child.tag}>"
    for equality in document.children(of="equality"):
        if equality.tag != "joint":
            yield "equalities", equality.get("name") or f"<{equality.tag}>"
    for section in ("option", "size", "statistic", "visual"):
        for element in root.children(section):
            yield "options", f"<{element.tag}>"
    for world in root.children("worldbody"):
        for child in world.children():
            if child.tag == "geom":
                yield "world_geoms", child.get("name") or "<geom>"
            elif child.tag in _IN_BODIES:
                yield _IN_BODIES[child.tag], child.get("name") or f"<{child.tag}>"
        yield from _body(document, world, "<body>", None)


def _body(document: MjcfDocument, body: Element, owner: str, childclass: str | None) -> Iterator[tuple[str, str]]:
    """Yield the contents of a body, including nested bodies and frames."""
    childclass = body.get("childclass") or childclass
    if body.number("gravcomp", "0"):
        yield "gravity_compensation", owner
    for child in body.children():
        if child.tag in ("body", "frame"):
            name = child.get("name") or owner if child.tag == "body" else owner
            yield from _body(document, child, name, childclass)
        elif body.tag != "worldbody":
            yield from _in_body(document.with_defaults(child, childclass), owner)


def _in_body(child: Element, owner: str) -> Iterator[tuple[str, str]]:
    match child.tag:
        case "inertial":
            yield "inertias", owner
        case "geom":
            drawn = child.get("contype") == "0" and child.get("conaffinity") == "0"
            shape = "meshes" if child.get("mesh") is not None else "shapes"
            yield f"{'visual' if drawn else 'collision'}_{shape}", owner
            if child.get("rgba"):
                yield "colours", owner
        case "joint":
            if child.numbers("stiffness", default="0")[0]:
                yield "joint_springs", child.get("name") or owner
            if child.number("armature", "0"):
                yield "armatures", child.get("name") or owner
        case _ if child.tag in _IN_BODIES:
            yield _IN_BODIES[child.tag], owner
