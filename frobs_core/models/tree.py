"""What makes links and joints a tree."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from frobs_core.models.model import Joint
from frobs_core.models.xmltree import Element


def check_unique(elements: Iterable[Element]) -> dict[str, Element]:
    """Return named elements by name.

    Raises:
        ModelFileError: One has no name, or two have the same.
    """
    named: dict[str, Element] = {}
    for element in elements:
        name = element.required("name")
        if name in named:
            first = named[name].line
            where = f" the first is in line {first}" if first else " it is there twice"
            element.refuse(f"the name '{name}' is taken:{where}.")
        named[name] = element
    return named


def check_tree(
    links: Iterable[str], joints: Iterable[Joint], elements: Mapping[str, Element], document: Element
) -> None:
    """Check that every link but one is the child of one joint, and that there are no rings.

    Args:
        links: Names of the links.
        joints: The joints.
        elements: Of the joints, by name.
        document: What holds them.

    Raises:
        ModelFileError: A link has two parents, several links have none, or joints form a ring.
    """
    links = list(links)
    above: dict[str, Joint] = {}
    for joint in joints:
        if joint.child in above:
            elements[joint.name].refuse(
                f"the link '{joint.child}' is already the child of joint '{above[joint.child].name}'; loops are not "
                "supported: cut it, or describe the robot in MJCF, which can close it with <equality>."
            )
        above[joint.child] = joint
    roots = [link for link in links if link not in above]
    if len(roots) > 1:
        document.refuse(f"the links {', '.join(roots)} have no parent; join all but one with joints.")
    for link in links:
        seen: list[str] = []
        at = link
        while at in above:
            if at in seen:
                ring = " → ".join(reversed([*seen[seen.index(at) :], at]))
                elements[above[at].name].refuse(f"the joints form a ring: {ring}.")
            seen.append(at)
            at = above[at].parent
