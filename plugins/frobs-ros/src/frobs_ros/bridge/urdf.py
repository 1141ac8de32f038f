"""Conversion of URDF or xacro text to a model description. The text is interpreted as in Gazebo."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot
from frobs_core.models import RobotModel, load_model
from frobs_ros.bridge.gazebo_elements import read_lidars
from frobs_ros.bridge.model import Description, with_gains

_INTERFACES = {
    "PositionJointInterface": CommandMode.POSITION,
    "VelocityJointInterface": CommandMode.VELOCITY,
    "EffortJointInterface": CommandMode.EFFORT,
}


def describe_urdf(text: str) -> Description:
    """Parse URDF text, or xacro text without arguments.

    The base is fixed if the root link is named ``world`` or the file sets ``<static>``. Otherwise, the base floats.
    Links of the same robot do not collide with each other unless the file sets ``<selfCollide>``. The transmission of a
    joint defines the joint's command mode. A joint without a transmission moves freely.

    Raises:
        ModelFileError: The text does not describe a valid robot.
    """
    ending = ".urdf.xacro" if "<xacro:" in text else ".urdf"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"spawned{ending}")
        file.write_text(text)
        model = load_model(file)
    root = ElementTree.fromstring(model.xml)
    elements = tuple(root.findall("gazebo"))
    modes = _modes(root)
    static = any(_says(element, "static") for element in elements)
    robot = Robot(
        model=str(model.path),
        name=model.name,
        base="fixed" if static or model.root == "world" else "floating",
        friction=read_friction(elements, model),
        self_collision=any(_says(element, "selfCollide") for element in elements),
    )
    robot = with_gains(replace(robot, sensors=read_lidars(elements)), model)
    mode = next(iter(modes.values()), CommandMode.EFFORT)
    return Description(
        placement=Placement(robot=robot, model=model, command_mode=mode),
        modes=modes,
        elements=elements,
        has_transmissions=bool(modes),
    )


def describe_robot(robot: Robot) -> Description:
    """Return the model description of a FRobs robot.

    Joints without a transmission hold their positions. Wheels without a transmission hold zero velocity.

    Raises:
        ModelFileError: The model file is invalid.
    """
    model = robot.read_model()
    elements = gazebo_elements(model)
    robot = replace(robot, sensors={**read_lidars(elements), **robot.sensors})
    modes = _modes(ElementTree.fromstring(model.xml)) if model.format == "urdf" else {}
    wheels = robot.differential_drive.left + robot.differential_drive.right if robot.differential_drive else ()
    held = {name: CommandMode.VELOCITY if name in wheels else CommandMode.POSITION for name in model.joint_names}
    return Description(
        placement=Placement(robot=with_gains(robot, model), model=model, command_mode=CommandMode.POSITION),
        modes={**held, **modes},
        elements=elements,
        has_transmissions=bool(modes),
    )


def with_file_uris(text: str) -> str:
    """Return a URDF with absolute mesh paths replaced by ``file://`` URIs, because RViz cannot open plain paths."""
    root = ElementTree.fromstring(text)
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if name.startswith("/"):
            mesh.set("filename", f"file://{name}")
    return ElementTree.tostring(root, encoding="unicode")


def gazebo_elements(model: RobotModel) -> tuple[Element, ...]:
    """Return the ``<gazebo>`` elements of a robot's file."""
    return tuple(ElementTree.fromstring(model.xml).findall("gazebo")) if model.format == "urdf" else ()


def read_friction(elements: tuple[Element, ...], model: RobotModel) -> Mapping[str, float]:
    """Return the friction coefficients that the file specifies, by link name, including links at fixed joints."""
    links = {link.name for link in model.links if link.collisions}
    friction = {}
    for element in elements:
        link, given = element.get("reference", ""), element.findtext("mu1") or element.findtext("mu")
        if link in links and given:
            friction[link] = min(float(given), 10.0)  # many Gazebo files use 100000 for very high friction
    return friction


def _modes(root: Element) -> dict[str, CommandMode]:
    modes = {}
    for transmission in root.findall("transmission"):
        for joint in transmission.findall("joint"):
            name = (joint.findtext("hardwareInterface") or "").strip().rpartition("/")[2]
            modes[joint.get("name", "")] = _INTERFACES.get(name, CommandMode.EFFORT)
    return modes


def _says(element: Element, tag: str) -> bool:
    return (element.findtext(tag) or "").strip().lower() in ("1", "true")
