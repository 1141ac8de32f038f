"""Reads a robot's groups, named states, end effectors and disabled collisions from SRDF files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from frobs_core.models import RobotModel, joint_path, outward
from frobs_models import Element, parse_xml


@dataclass(frozen=True)
class Group:
    """A group of joints whose motions are planned together."""

    name: str
    joint_names: tuple[str, ...]  # actuated joints, in the order of the robot's model
    links: tuple[str, ...]  # child links of the joints, from the root outward
    tip: str  # last link if the joints form a chain, otherwise an empty string
    states: Mapping[str, Mapping[str, float]]  # [rad or m] joint positions of each named state, by joint name


@dataclass(frozen=True)
class Semantics:
    """The contents of an SRDF file."""

    groups: Mapping[str, Group]
    end_effectors: Mapping[str, str]  # link to which each end effector is attached, by the end effector's name
    planning_frame: str  # frame in which all poses are expressed, which coincides with the root link
    may_touch: tuple[tuple[str, str], ...]  # pairs of links for which collisions are disabled


def read_srdf(text: str, model: RobotModel, source: str) -> Semantics:
    """Read the XML text of an SRDF. ``source``, such as the parameter's name, is used in error messages."""
    root = parse_xml(text, Path(source))
    if root.tag != "robot":
        root.refuse("the root element of an SRDF must be <robot>.")
    elements = {element.required("name"): element for element in root.children("group")}
    virtual = {element.required("name") for element in root.children("virtual_joint")}
    return Semantics(
        groups={name: _group(name, elements, virtual, root, model) for name in elements},
        end_effectors={
            element.required("name"): element.required("parent_link") for element in root.children("end_effector")
        },
        planning_frame=_planning_frame(root, model),
        may_touch=tuple(
            (element.required("link1"), element.required("link2")) for element in root.children("disable_collisions")
        ),
    )


def _group(name: str, elements: Mapping[str, Element], virtual: set[str], root: Element, model: RobotModel) -> Group:
    members = _members(name, elements, model, virtual)
    joints = [joint for joint in outward(model) if joint.name in members]
    if not joints:
        elements[name].refuse(f"the group '{name}' has no joints.")
    on_the_way = {joint.name for joint in joint_path(model, joints[-1].child)}
    states = {
        state.required("name"): {joint.required("name"): joint.number("value") for joint in state.children("joint")}
        for state in root.children("group_state")
        if state.get("group") == name
    }
    return Group(
        name=name,
        joint_names=tuple(joint for joint in model.joint_names if joint in members),
        links=tuple(joint.child for joint in joints),
        tip=joints[-1].child if members <= on_the_way else "",
        states=states,
    )


def _members(
    name: str, elements: Mapping[str, Element], model: RobotModel, virtual: set[str], outer: tuple[str, ...] = ()
) -> set[str]:
    """Return a group's joint names, including fixed joints. ``outer`` lists the groups that contain this group."""
    joints, above = {joint.name for joint in model.joints}, {joint.child: joint.name for joint in model.joints}
    links = {link.name for link in model.links}
    members: set[str] = set()
    for element in elements[name].children("joint", "link", "chain", "group"):
        if element.tag == "joint":
            joint = element.required("name")
            if joint not in joints | virtual:
                element.refuse(f"the robot has no joint '{joint}'.")
            members |= {joint} & joints
        elif element.tag == "link":
            members |= {above[link] for link in [_link(element, "name", links)] if link in above}
        elif element.tag == "chain":
            base, tip = _link(element, "base_link", links), _link(element, "tip_link", links)
            path = joint_path(model, tip)
            passed = [joint.parent for joint in path] + [tip]
            if base not in passed:
                element.refuse(
                    f"the link '{tip}' is not a descendant of the link '{base}', so they do not form a chain."
                )
            members |= {joint.name for joint in path[passed.index(base) :]}
        else:
            other = element.required("name")
            if other not in elements or other in (*outer, name):
                element.refuse(f"the group '{other}' does not exist, or contains the group '{name}' itself.")
            members |= _members(other, elements, model, virtual, (*outer, name))
    return members


def _link(element: Element, attribute: str, links: set[str]) -> str:
    name = element.required(attribute)
    if name not in links:
        element.refuse(f"the robot has no link '{name}'.")
    return name


def _planning_frame(root: Element, model: RobotModel) -> str:
    for joint in root.children("virtual_joint"):
        if joint.get("type") != "fixed":
            joint.refuse("only virtual joints of the type 'fixed' are supported, because the robot's base cannot move.")
        return joint.required("parent_frame")
    return model.root
