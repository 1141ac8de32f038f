"""Attaches an end effector to an arm by merging their model files and descriptions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree as ET

from frobs_core.description import ALL, DriveGains, EndEffector, Robot
from frobs_core.models import RobotModel, Vector3, default_gains, default_tcp, home_positions, joint_path, load_model
from frobs_core.util.errors import UnsuitableRobotError, check_name
from frobs_models.assembled import write_model
from frobs_models.grippers.loops import without_loops
from frobs_models.tree import UNKNOWN_MASS, check_masses
from frobs_models.urdf.writing import urdf_of

_NAMED = ("link", "joint", "material", "transmission", "actuator")
_REFERENCES = {"parent": "link", "child": "link", "mimic": "joint", "gazebo": "reference"}
"""XML attributes that refer to a link or a joint, by element name."""


def attach(arm: Robot, link: str, tool: Robot, name: str, pos: Vector3, rpy: Vector3) -> Robot:
    """Return an arm with an attached end effector.

    For the arguments and errors, see :meth:`frobs_core.description.Robot.attach`.
    """
    arm, tool = _as_urdf(arm), _as_urdf(tool)
    arm_model, tool_model = arm.read_model(), tool.read_model()
    links = [item.name for item in arm_model.links]
    check_name(f"link of robot '{arm.name}'", link, links)
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
    cameras = {key: replace(camera, frame=f"{name}_{camera.frame}") for key, camera in tool.cameras.items()}
    sensors = {key: replace(sensor, frame=f"{name}_{sensor.frame}") for key, sensor in tool.sensors.items()}
    combined = replace(
        arm,
        model=str(write_model(title, _join(arm_model, link, tool_model, name, title, pos, rpy))),
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
        cameras={**arm.cameras, **cameras},
    )
    return replace(combined, gains=_gains(combined, arm, arm_model, tool, tool_model, name))


def _as_urdf(robot: Robot) -> Robot:
    """Return the description of a robot whose model is a URDF file."""
    if (model := robot.read_model()).format == "urdf":
        return robot
    check_masses(model, UNKNOWN_MASS)
    motors = {joint.name: joint.armature for joint in model.joints if joint.armature}  # a URDF cannot contain them
    file = write_model(model.name, ET.tostring(urdf_of(without_loops(model)), encoding="unicode"))
    return replace(robot, model=str(file), armature={**motors, **robot.armature})


def _renamed(arm: Robot) -> dict[str, str]:
    """Return an arm's default controllers, with the implicit group ``"all"`` renamed to ``"arm"``."""
    return {"arm" if group == ALL else group: controller for group, controller in arm.default_controllers.items()}


def _join(arm: RobotModel, link: str, tool: RobotModel, name: str, title: str, pos: Vector3, rpy: Vector3) -> str:
    """Return the text of a URDF that contains both models and a fixed joint between them."""
    combined, part = ET.fromstring(arm.xml), ET.fromstring(tool.xml)
    combined.set("name", title)
    for element in part.iter():
        if element.tag in _NAMED and element.get("name"):  # many exporters write materials with an empty name
            element.set("name", f"{name}_{element.get('name')}")
        attribute = _REFERENCES.get(element.tag, "")
        if attribute in element.attrib:
            element.set(attribute, f"{name}_{element.get(attribute)}")
    mounted = f"{name}_mount"
    while any(joint.get("name") == mounted for joint in part.iter("joint")):
        mounted += "ed"
    mount = ET.SubElement(combined, "joint", {"name": mounted, "type": "fixed"})
    ET.SubElement(mount, "parent", {"link": link})
    ET.SubElement(mount, "child", {"link": f"{name}_{tool.root}"})
    ET.SubElement(mount, "origin", {"xyz": _numbers(pos), "rpy": _numbers(rpy)})
    combined.extend(part)
    ET.indent(combined)
    return ET.tostring(combined, encoding="unicode") + "\n"


def _numbers(vector: Vector3) -> str:
    """Return numbers as text, also those of NumPy."""
    return " ".join(repr(float(number)) for number in vector)


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
