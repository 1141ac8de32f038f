"""Checks that links and joints form a tree."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from frobs_core.models import Joint, JointType, Mimic, RobotModel
from frobs_core.util.errors import ModelFileError
from frobs_models.budgets import BUDGETS
from frobs_models.xmltree import Element

UNKNOWN_MASS = "only MuJoCo can measure, and FRobs describes a robot with a gripper as a URDF"
"""End of the error message if a model with unknown masses would be written as a URDF."""


def check_count(count: int, what: str, document: Element) -> None:
    """Check the number of links, because the kinematics take time proportional to the square of this number."""
    limit = BUDGETS["robot file"]["links"]
    if count > limit:
        document.refuse(
            f"the robot has {count} {what}; the limit is {limit}. Merge links that are connected by fixed joints."
        )


def check_unique(elements: Iterable[Element]) -> dict[str, Element]:
    """Return named elements by name.

    Raises:
        ModelFileError: An element has no name, or two elements have the same name.
    """
    named: dict[str, Element] = {}
    for element in elements:
        name = element.required("name")
        if name in named:
            first = named[name].line
            where = f" it first occurs in line {first}" if first else " it occurs twice"
            element.refuse(f"the name '{name}' is already used:{where}.")
        named[name] = element
    return named


def check_tree(
    links: Iterable[str], joints: Iterable[Joint], elements: Mapping[str, Element], document: Element
) -> None:
    """Check that every link except one is the child of exactly one joint, and that there are no cycles.

    Args:
        links: Names of the links.
        joints: The joints.
        elements: XML elements of the joints, by joint name.
        document: XML element that contains the links and joints.

    Raises:
        ModelFileError: A link has two parents, several links have no parent, or joints form a cycle.
    """
    links = list(links)
    above: dict[str, Joint] = {}
    for joint in joints:
        if joint.child in above:
            elements[joint.name].refuse(
                f"the link '{joint.child}' is already the child of joint '{above[joint.child].name}'; loops are not "
                "supported. Remove one joint of the loop, or use an MJCF file, in which <equality> can close the loop."
            )
        above[joint.child] = joint
    roots = [link for link in links if link not in above]
    if len(roots) > 1:
        document.refuse(f"the links {', '.join(roots)} have no parent; connect all but one with joints.")
    hang_from_root: set[str] = set(roots)
    for link in links:
        seen: dict[str, None] = {}  # ordered
        at = link
        while at not in hang_from_root:
            if at in seen:
                way = list(seen)
                ring = " → ".join(reversed([*way[way.index(at) :], at]))
                elements[above[at].name].refuse(f"the joints form a cycle: {ring}.")
            seen[at] = None
            at = above[at].parent
        hang_from_root |= seen.keys()


def flatten_mimics(joints: Sequence[Joint], elements: Mapping[str, Element]) -> tuple[Joint, ...]:
    """Return the joints after changing every mimic joint to follow an actuated joint directly.

    Args:
        joints: The joints.
        elements: XML elements of the joints for error messages, by joint name.

    Raises:
        ModelFileError: Joints mimic each other in a cycle, or mimic a fixed, floating or planar joint.
    """
    by_name = {joint.name: joint for joint in joints}
    flat = []
    for joint in joints:
        seen, leader, multiplier, offset = {joint.name}, joint, 1.0, 0.0
        while leader.mimic is not None:
            offset += multiplier * leader.mimic.offset
            multiplier *= leader.mimic.multiplier
            leader = by_name[leader.mimic.joint]
            if leader.name in seen:
                elements[joint.name].refuse(f"the joint '{joint.name}' follows itself: {', '.join(sorted(seen))}.")
            seen.add(leader.name)
        if leader is not joint:
            if leader.type in (JointType.FIXED, JointType.FLOATING, JointType.PLANAR):
                kind = leader.type.value
                elements[joint.name].refuse(f"'{joint.name}' mimics '{leader.name}', which is a {kind} joint.")
            joint = replace(joint, mimic=Mimic(leader.name, multiplier, offset))
        flat.append(joint)
    return tuple(flat)


def check_masses(model: RobotModel, which: str) -> None:
    """Check that the masses of all links are known without MuJoCo.

    Args:
        model: The model.
        which: Description of the shapes whose masses are not known, for the error message.

    Raises:
        ModelFileError: A mass is unknown.
    """
    if unknown := [note.element for note in model.notes if note.rule == "mesh-mass"]:
        raise ModelFileError(
            model.path, f"the mass of {', '.join(unknown)} depends on shapes that {which}; add an <inertial>."
        )


def joints_below(model: RobotModel) -> dict[str, list[Joint]]:
    """Return the child joints of each link, by link name.

    Raises:
        ModelFileError: The model has floating or planar joints, which no simulator supports, or passive joints or
            unknown masses, which only MuJoCo supports.
    """
    if model.passive_joints:
        raise ModelFileError(
            model.path,
            f"the file has no actuators for the joints {', '.join(model.passive_joints)}; only simulator='mujoco' "
            "simulates passive joints.",
        )
    check_masses(model, "only simulator='mujoco' supports")
    below: dict[str, list[Joint]] = {}
    for joint in model.joints:
        if joint.type in (JointType.FLOATING, JointType.PLANAR):
            raise ModelFileError(
                model.path,
                f"joint '{joint.name}' is {joint.type.value}; only revolute, continuous, prismatic and fixed joints "
                "can be simulated. For a free base, set base='floating' in the robot's description.",
            )
        below.setdefault(joint.parent, []).append(joint)
    return below
