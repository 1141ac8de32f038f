"""Attaches an end effector to an arm by merging their model files and descriptions."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from frobs_core.description import ALL, DriveGains, EndEffector, Robot
from frobs_core.models import RobotModel, Vector3, default_gains, default_tcp, home_positions, joint_path, load_model
from frobs_core.util.errors import UnsuitableRobotError, check_name
from frobs_core.util.files import cache_folder, write_text

_NAMED = ("link", "joint", "material", "transmission", "actuator")
_REFERENCES = {"parent": "link", "child": "link", "mimic": "joint", "gazebo": "reference"}
"""XML attributes that refer to a link or a joint, by element name."""


def attach(arm: Robot, link: str, tool: Robot, name: str, pos: Vector3, rpy: Vector3) -> Robot:
    """Return an arm with an attached end effector. See :meth:`frobs_core.description.Robot.attach`."""
    arm_model, tool_model = (
        load_model(part.model, xacro_args=part.xacro_args, package_paths=part.package_paths) for part in (arm, tool)
    )
    links = [item.name for item in arm_model.links]
    check_name(f"link of robot '{arm.name}'", link, links)
    for part, model in ((arm, arm_model), (tool, tool_model)):
        if model.format != "urdf":
            raise UnsuitableRobotError(part.name, "is an MJCF file; only URDF and xacro models can be attached.")
    if tool.groups:
        raise UnsuitableRobotError(
            tool.name,
            "has joint groups, so it cannot be attached; remove the groups, because a tool has a single group.",
        )
    groups = dict(arm.groups) or {"arm": arm_model.joint_names}
    if name in groups or name in arm.end_effectors:
        raise UnsuitableRobotError(
            arm.name, f"already has a joint group or an end effector named '{name}'; choose another name."
        )

    def prefixed(given: Mapping[str, Any]) -> dict[str, Any]:
        return {f"{name}_{key}": value for key, value in given.items()}

    on_the_way = {joint.name for joint in joint_path(arm_model, link)}
    described = next(iter(tool.end_effectors.values()), EndEffector(tcp=tool.tcp or default_tcp(tool_model)))
    effector = replace(
        described,
        tcp=f"{name}_{described.tcp}",
        arm=next((group for group, joints in groups.items() if on_the_way & {*joints}), ""),
        group=name if tool_model.joint_names else "",
        open=prefixed(described.open),
        closed=prefixed(described.closed),
    )
    controllers = {name: tool.default_controllers[ALL]} if ALL in tool.default_controllers else {}
    if effector.group:
        groups[name] = tuple(f"{name}_{joint}" for joint in tool_model.joint_names)
    title = f"{arm.name}_{tool.name}"
    sensors = {key: replace(sensor, frame=f"{name}_{sensor.frame}") for key, sensor in tool.sensors.items()}
    combined = replace(
        arm,
        model=str(_write(title, _join(arm_model, link, tool_model, name, title, pos, rpy))),
        name=title,
        xacro_args={},
        package_paths={},
        home={**arm.home, **prefixed(tool.home)},
        tcp=effector.tcp,
        sensors={**arm.sensors, **prefixed(sensors)},
        friction={**arm.friction, **prefixed(tool.friction)},
        armature={**arm.armature, **prefixed(tool.armature)},
        groups=groups,
        default_controllers={**_renamed(arm), **controllers},
        end_effectors={**arm.end_effectors, name: effector},
    )
    return replace(combined, gains=_gains(combined, arm, arm_model, tool, tool_model, name))


def _renamed(arm: Robot) -> dict[str, str]:
    """Return an arm's default controllers, with the implicit group ``"all"`` renamed to ``"arm"``."""
    return {"arm" if group == ALL else group: controller for group, controller in arm.default_controllers.items()}


def _join(arm: RobotModel, link: str, tool: RobotModel, name: str, title: str, pos: Vector3, rpy: Vector3) -> str:
    """Return the text of a URDF that contains both models and a fixed joint between them."""
    combined, part = ET.fromstring(arm.xml), ET.fromstring(tool.xml)
    combined.set("name", title)
    for element in part.iter():
        if element.tag in _NAMED and "name" in element.attrib:
            element.set("name", f"{name}_{element.get('name')}")
        attribute = _REFERENCES.get(element.tag, "")
        if attribute in element.attrib:
            element.set(attribute, f"{name}_{element.get(attribute)}")
    mount = ET.SubElement(combined, "joint", {"name": f"{name}_mount", "type": "fixed"})
    ET.SubElement(mount, "parent", {"link": link})
    ET.SubElement(mount, "child", {"link": f"{name}_{tool.root}"})
    ET.SubElement(mount, "origin", {"xyz": " ".join(map(repr, pos)), "rpy": " ".join(map(repr, rpy))})
    combined.extend(part)
    ET.indent(combined)
    return ET.tostring(combined, encoding="unicode") + "\n"


def _write(title: str, text: str) -> Path:
    """Write a model file to the cache under a name derived from its content."""
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    path = cache_folder("assembled") / f"{title}-{digest}.urdf"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
    return path


def _gains(
    combined: Robot, arm: Robot, arm_model: RobotModel, tool: Robot, tool_model: RobotModel, name: str
) -> DriveGains | None:
    """Return the combined drive gains of the arm and the tool.

    An arm or tool without gains uses the combined model's default gains.
    """
    if arm.gains is None and tool.gains is None:
        return None
    model = load_model(combined.model)
    gains = {joint: default_gains(model, home_positions(model, combined.home)).of(joint) for joint in model.joint_names}
    for part, joints, prefix in ((arm, arm_model.joint_names, ""), (tool, tool_model.joint_names, f"{name}_")):
        if part.gains is not None:
            gains |= {prefix + joint: part.gains.of(joint) for joint in joints}
    return DriveGains(
        stiffness={joint: kp for joint, (kp, _) in gains.items()},
        damping={joint: kd for joint, (_, kd) in gains.items()},
    )
