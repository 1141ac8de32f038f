"""Writes a model as a URDF, so that the gripper of an MJCF file can be described like that of a URDF."""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree import ElementTree as ET

from frobs_core.models import MOVING, Box, Capsule, Cylinder, Geometry, Joint, JointType, Mesh, Pose, RobotModel, Sphere
from frobs_core.util.rotations import rpy_from_quat


def urdf_of(model: RobotModel) -> ET.Element:
    """Return the URDF of a model. Joints without a drive become fixed.

    Args:
        model: Model of a robot, in any format.
    """
    root = ET.Element("robot", {"name": model.name})
    for link in model.links:
        element = ET.SubElement(root, "link", {"name": link.name})
        if link.inertial is not None:
            inertial = ET.SubElement(element, "inertial")
            _origin(inertial, link.inertial.origin)
            ET.SubElement(inertial, "mass", {"value": repr(float(link.inertial.mass))})
            moments = dict(zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), link.inertial.inertia, strict=True))
            ET.SubElement(inertial, "inertia", {name: repr(float(moment)) for name, moment in moments.items()})
        for tag, shapes in (("visual", link.visuals), ("collision", link.collisions)):
            for shape in shapes:
                part = ET.SubElement(element, tag)
                _origin(part, shape.origin)
                kind, attributes = _geometry(shape.geometry)
                ET.SubElement(ET.SubElement(part, "geometry"), kind, attributes)
                rgba = getattr(shape, "rgba", None)
                if rgba is not None:
                    material = ET.SubElement(part, "material", {"name": ""})
                    ET.SubElement(material, "color", {"rgba": _numbers(rgba)})
    for joint in model.joints:
        _joint(root, joint, joint.name in model.passive_joints)
    return root


def _joint(root: ET.Element, joint: Joint, passive: bool) -> None:
    kind = JointType.FIXED if passive else joint.type
    limits = joint.limits
    limited = math.isfinite(limits.lower) and math.isfinite(limits.upper)
    element = ET.SubElement(root, "joint", {"name": joint.name, "type": kind.value})
    _origin(element, joint.origin)
    ET.SubElement(element, "parent", {"link": joint.parent})
    ET.SubElement(element, "child", {"link": joint.child})
    if kind not in MOVING:
        return
    ET.SubElement(element, "axis", {"xyz": _numbers(joint.axis)})
    bounds: dict[str, float] = {"lower": limits.lower, "upper": limits.upper} if limited else {}
    ET.SubElement(element, "limit", _texts({"effort": limits.effort, "velocity": limits.velocity, **bounds}))
    ET.SubElement(element, "dynamics", _texts({"damping": joint.damping, "friction": joint.friction}))
    if joint.mimic is not None:
        ratio = {"multiplier": joint.mimic.multiplier, "offset": joint.mimic.offset}
        ET.SubElement(element, "mimic", {"joint": joint.mimic.joint, **_texts(ratio)})


def _geometry(geometry: Geometry) -> tuple[str, dict[str, str]]:
    match geometry:
        case Box(size):
            return "box", {"size": _numbers(size)}
        case Sphere(radius):
            return "sphere", _texts({"radius": radius})
        case Cylinder(radius, length):
            return "cylinder", _texts({"radius": radius, "length": length})
        case Capsule(radius, length):
            return "capsule", _texts({"radius": radius, "length": length})
        case Mesh(path, scale):
            return "mesh", {"filename": str(path), "scale": _numbers(scale)}


def _origin(element: ET.Element, pose: Pose) -> None:
    ET.SubElement(element, "origin", {"xyz": _numbers(pose.pos), "rpy": _numbers(rpy_from_quat(pose.quat_wxyz))})


def _texts(values: Mapping[str, float]) -> dict[str, str]:
    return {name: repr(float(value)) for name, value in values.items()}


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)
