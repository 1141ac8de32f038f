"""The URDF reader.

Nothing is changed silently. Ambiguous or meaningless elements, such as a link with two parents, a zero axis or a number
that is not finite, raise an error. Elements that engines cannot simulate but that have an obvious interpretation are
repaired in the model's ``xml``, and a note is added to ``RobotModel.notes``. ``frobs_models.RULES`` contains the
rules for repairs.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

from frobs_core.models import MOVING, Joint, JointLimits, JointType, Link, Mimic, RobotModel
from frobs_models.inertia import read_inertials
from frobs_models.limits import MAX_COEFFICIENT
from frobs_models.notes import Notes
from frobs_models.resources import Packages
from frobs_models.tree import check_count, check_tree, check_unique, flatten_mimics
from frobs_models.urdf.schema import note_what_is_left_out
from frobs_models.urdf.shapes import Shapes, read_pose
from frobs_models.xmltree import Element, suggestion, to_text


def read_urdf(root: Element, path: Path, packages: Packages) -> RobotModel:
    """Read a URDF document.

    Mesh paths in ``root`` are made absolute.

    Raises:
        ModelFileError: The document is invalid. The message contains the element, the file and the line.
    """
    notes = Notes()
    name = root.get("name", "").strip()
    if not name:
        name = path.name.split(".")[0]
        notes.add("unnamed", root, f"the robot has no name; '{name}' is used")
    note_what_is_left_out(root, notes)
    link_elements = check_unique(root.children("link"))
    if not link_elements:
        root.refuse("there is no <link>.")
    check_count(len(link_elements), "links", root)
    joint_elements = check_unique(root.children("joint"))
    shapes = Shapes(packages, root.children("material"), notes)
    joints = tuple(_joint(element, link_elements, joint_elements, notes) for element in joint_elements.values())
    check_tree(link_elements, joints, joint_elements, root)
    joints = tuple(_held(joint, joints, joint_elements[joint.name], notes) for joint in joints)
    joints = flatten_mimics(joints, joint_elements)
    inertials = read_inertials(link_elements, joints, notes)
    links = tuple(
        Link(
            name=link,
            inertial=inertials[link],
            visuals=tuple(shapes.visual(v) for v in shapes.present(element, "visual")),
            collisions=tuple(shapes.collision(c) for c in shapes.present(element, "collision")),
        )
        for link, element in link_elements.items()
    )
    _warn_of_missing_visuals(path, notes)
    return RobotModel(
        name=name, path=path, format="urdf", xml=to_text(root), links=links, joints=joints, notes=tuple(notes)
    )


def _warn_of_missing_visuals(path: Path, notes: Notes) -> None:
    missing = [note for note in notes if note.rule == "missing-visual"]
    if missing:
        links = ", ".join(dict.fromkeys(note.element for note in missing))
        warnings.warn(f"{path}: {links}: {missing[0].text}; {len(missing)} in all.", stacklevel=2)


def read_joint(element: Element, links: Collection[str], joints: Collection[str]) -> Joint:
    """Read the origin and type of a joint, without its limits and dynamics.

    Args:
        element: The ``<joint>``.
        links: Names of the links.
        joints: Names of the joints.

    Raises:
        ModelFileError: The joint's type, axis, parent link, child link or mimicked joint is missing or invalid.
    """
    name = element.required("name")
    try:
        kind = JointType(element.required("type"))
    except ValueError:
        known = [member.value for member in JointType]
        hint = suggestion(element.get("type", ""), known)
        element.refuse(f"the joint type '{element.get('type')}' does not exist.{hint} Available: {', '.join(known)}.")
    ends = []
    for tag in ("parent", "child"):
        end = element.child(tag)
        if end is None:
            element.refuse(f"<{tag} link=…/> is missing.")
        link = end.required("link")
        if link not in links:
            hint = suggestion(link, links)
            element.refuse(f"the joint's {tag} link '{link}' does not exist.{hint} Links: {', '.join(links)}.")
        ends.append(link)
    moving = kind in MOVING
    return Joint(
        name=name,
        type=kind,
        parent=ends[0],
        child=ends[1],
        origin=read_pose(element),
        axis=_axis(element) if moving else (1.0, 0.0, 0.0),
        mimic=_mimic(element, joints) if moving else None,
    )


def _joint(element: Element, links: dict[str, Element], joints: dict[str, Element], notes: Notes) -> Joint:
    joint = read_joint(element, links, joints)
    dynamics = element.child("dynamics")
    limits = _limits(element, joint.type, notes) if joint.type in MOVING else JointLimits()
    kind = joint.type
    if kind == JointType.REVOLUTE and math.isinf(limits.upper):
        kind = JointType.CONTINUOUS
        element.set("type", kind.value)
    return replace(
        joint,
        type=kind,
        limits=limits,
        damping=_not_negative(dynamics, "damping", MAX_COEFFICIENT) if dynamics is not None else 0.0,
        friction=_not_negative(dynamics, "friction", MAX_COEFFICIENT) if dynamics is not None else 0.0,
    )


def _held(joint: Joint, joints: Sequence[Joint], element: Element, notes: Notes) -> Joint:
    """Return a joint with at most one degree of freedom. A floating joint at the robot's base becomes fixed."""
    if joint.type not in (JointType.FLOATING, JointType.PLANAR):
        return joint
    root = all(other.child != joint.parent for other in joints)
    if joint.type == JointType.PLANAR or not root or sum(other.parent == joint.parent for other in joints) > 1:
        element.refuse(
            f"a {joint.type.value} joint is not supported here, because it has more than one degree of freedom. "
            "Replace a planar joint with two prismatic joints and one revolute joint, and a floating joint with three "
            "prismatic joints and three revolute joints. For a free base, set base='floating' in the robot's "
            "description."
        )
    element.set("type", "fixed")
    notes.add(
        "free-root", element, "the floating joint of the base is treated as fixed; for a free base, set base='floating'"
    )
    return replace(joint, type=JointType.FIXED)


def _not_negative(element: Element, attribute: str, limit: float = math.inf) -> float:
    value = element.number(attribute, "0", limit)
    return value if value >= 0.0 else element.refuse(f"{attribute}={value:g} is negative.")


def _axis(element: Element) -> tuple[float, float, float]:
    axis = element.child("axis")
    if axis is None:
        return (1.0, 0.0, 0.0)  # URDF's default
    x, y, z = axis.numbers("xyz", 3)
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-9:
        axis.refuse(f"the axis of joint '{element.get('name')}' is zero; specify its direction.")
    if abs(length - 1.0) < 1e-12:
        return (x, y, z)
    return (x / length, y / length, z / length)


def _limits(element: Element, kind: JointType, notes: Notes) -> JointLimits:
    limit = element.child("limit")
    if limit is None:
        if kind != JointType.CONTINUOUS:
            notes.add("no-range", element, f"the {kind.value} joint has no <limit>, so it is treated as unlimited")
        return JointLimits()
    caps = []
    for attribute in ("velocity", "effort"):
        cap = limit.cap(attribute)
        if cap <= 0.0:
            notes.add("no-cap", element, f"the {attribute} limit is not positive, so it is treated as infinite")
        caps.append(cap if cap > 0.0 else math.inf)
    unlimited = JointLimits(velocity=caps[0], effort=caps[1])
    lower, upper = limit.number("lower", "0"), limit.number("upper", "0")
    if kind == JointType.CONTINUOUS:
        if lower < upper:
            notes.add(
                "continuous-range",
                element,
                f"the range from {lower:g} to {upper:g} is ignored, because the joint is continuous",
            )
        return unlimited
    if lower > upper or lower == upper == 0.0:
        notes.add(
            "no-range",
            element,
            f"lower={lower:g} and upper={upper:g} are not a valid range, so the joint is treated as unlimited",
        )
        return unlimited
    if lower == upper:
        limit.refuse(
            f"joint '{element.get('name')}' has lower={lower:g} and upper={upper:g}, so it cannot move; use "
            'type="fixed", or type="continuous" for a joint without limits.'
        )
    return JointLimits(lower, upper, *caps)


def _mimic(element: Element, joints: Collection[str]) -> Mimic | None:
    mimic = element.child("mimic")
    if mimic is None:
        return None
    joint = mimic.required("joint")
    if joint not in joints:
        mimic.refuse(
            f"joint '{element.get('name')}' mimics '{joint}', which does not exist.{suggestion(joint, joints)}"
        )
    return Mimic(joint, mimic.number("multiplier", "1"), mimic.number("offset", "0"))
