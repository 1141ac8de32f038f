"""Conversion of an SDF model to a URDF, in which link frames are located at the joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element as PlainElement
from xml.etree.ElementTree import SubElement

import numpy as np

from frobs_core.models import Box, Cylinder, Mesh, Sphere
from frobs_core.util.rotations import quat_conjugate, quat_rotate
from frobs_models import Element
from frobs_ros.bridge.poses import WORLD, Place
from frobs_ros.bridge.sdf.reading import check, number_of, numbers_of, place_of, says, text_of
from frobs_ros.bridge.sdf.shapes import Shape

if TYPE_CHECKING:
    from frobs_ros.bridge.sdf.model import SdfLink

_JOINTS = ("revolute", "continuous", "prismatic", "fixed")
_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_UNLIMITED = 1e15  # SDF writes 1e16 for no limit


def write_urdf(links: Mapping[str, SdfLink], model: Element) -> tuple[str, dict[str, Place], bool]:
    """Write the URDF of a model.

    Returns:
        The URDF text, the pose of each SDF link frame relative to the URDF link of the same name, and whether the base
        is fixed to the world.

    Raises:
        ModelFileError: A joint is not supported, or the joints do not form a tree.
    """
    joints = list(model.children("joint"))
    holds = [joint for joint in joints if text_of(joint, "parent") == "world"]
    moving = [joint for joint in joints if joint not in holds]
    for joint in holds:
        if joint.get("type") != "fixed":
            joint.refuse(
                "a joint to the world must be fixed; for a moving joint, add a base link to the model and attach the "
                "joint to this link."
            )
    # URDF link frames are at the joints. The root link uses the model frame, so its pose is the model's pose.
    frames = dict.fromkeys(links, WORLD)
    for joint in moving:
        child = text_of(joint, "child")
        for tag in ("parent", "child"):
            if text_of(joint, tag) not in links:
                joint.refuse(
                    f"the {tag} link '{text_of(joint, tag)}' is not in the model; existing links: {', '.join(links)}."
                )
        frames[child] = place_of(joint).after(links[child].place)
    robot = PlainElement("robot", {"name": model.required("name")})
    offsets = {name: link.place.seen_from(frames[name]) for name, link in links.items()}
    for name, link in links.items():
        _link(robot, name, link, offsets[name])
    for joint in moving:
        _joint(robot, joint, frames)
    return ElementTree.tostring(robot, encoding="unicode"), offsets, bool(holds)


def _link(robot: PlainElement, name: str, link: SdfLink, offset: Place) -> None:
    element = SubElement(robot, "link", {"name": name})
    inertial = link.element.child("inertial")
    if inertial is None:
        inertial = Element("inertial")  # SDF's defaults
    check(inertial, ("pose", "mass", "inertia"))
    written = SubElement(element, "inertial")
    _origin(written, place_of(inertial).after(offset))
    SubElement(written, "mass", {"value": repr(number_of(inertial, "mass", 1.0))})
    usual = {"ixx": 1.0, "iyy": 1.0, "izz": 1.0}
    values = {key: repr(number_of(inertial, f"inertia/{key}", usual.get(key, 0.0))) for key in _INERTIA}
    SubElement(written, "inertia", values)
    for shape in link.collisions:
        _shape(SubElement(element, "collision", {"name": shape.name}), shape, offset)
    for shape in link.visuals:
        visual = SubElement(element, "visual", {"name": shape.name})
        _shape(visual, shape, offset)
        material = SubElement(visual, "material", {"name": f"{name}/{shape.name}"})
        SubElement(material, "color", {"rgba": " ".join(map(repr, shape.rgba))})


def _joint(robot: PlainElement, joint: Element, frames: Mapping[str, Place]) -> None:
    check(joint, ("pose", "parent", "child", "axis"), ("physics",))
    kind = joint.get("type", "")
    if kind not in _JOINTS:
        joint.refuse(f"a joint of type '{kind}' is not supported; supported types: {', '.join(_JOINTS)}.")
    parent, child = text_of(joint, "parent"), text_of(joint, "child")
    axis = joint.child("axis")
    lower, upper = -math.inf, math.inf
    if axis is not None:
        check(axis, ("xyz", "limit", "dynamics", "use_parent_model_frame"), ("initial_position",))
        lower, upper = number_of(axis, "limit/lower", -math.inf), number_of(axis, "limit/upper", math.inf)
    unlimited = lower <= -_UNLIMITED or upper >= _UNLIMITED
    if kind == "revolute" and unlimited:
        kind = "continuous"
    element = SubElement(robot, "joint", {"name": joint.required("name"), "type": kind})
    _origin(element, frames[child].seen_from(frames[parent]))
    SubElement(element, "parent", {"link": parent})
    SubElement(element, "child", {"link": child})
    if axis is None or kind == "fixed":
        return
    direction = np.array(numbers_of(axis, "xyz", "0 0 1"))
    if says(axis, "use_parent_model_frame"):
        direction = quat_rotate(quat_conjugate(frames[child].quat_wxyz), direction)
    SubElement(element, "axis", {"xyz": _words(direction.tolist())})
    caps = {name: number_of(axis, f"limit/{name}", -1.0) for name in ("effort", "velocity")}
    limit = {name: repr(cap) for name, cap in caps.items() if 0.0 < cap < _UNLIMITED}
    if kind != "continuous" and not unlimited:
        limit |= {"lower": repr(lower), "upper": repr(upper)}
    SubElement(element, "limit", limit)
    dynamics = {name: repr(number_of(axis, f"dynamics/{name}", 0.0)) for name in ("damping", "friction")}
    SubElement(element, "dynamics", dynamics)


def _shape(element: PlainElement, shape: Shape, offset: Place) -> None:
    _origin(element, shape.place.after(offset))
    geometry = SubElement(element, "geometry")
    match shape.geometry:
        case Box(size):
            SubElement(geometry, "box", {"size": _words(size)})
        case Sphere(radius):
            SubElement(geometry, "sphere", {"radius": repr(radius)})
        case Cylinder(radius, length):
            SubElement(geometry, "cylinder", {"radius": repr(radius), "length": repr(length)})
        case Mesh(path, scale):
            SubElement(geometry, "mesh", {"filename": str(path), "scale": _words(scale)})


def _origin(element: PlainElement, place: Place) -> None:
    w, x, y, z = place.quat_wxyz.tolist()
    SubElement(element, "origin", {"xyz": _words(place.pos.tolist()), "quat_xyzw": _words((x, y, z, w))})


def _words(numbers: tuple[float, ...] | list[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)
