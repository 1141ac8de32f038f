"""The URDF elements and attributes that the reader uses.

All other elements and attributes are ignored, and a note is added for each.

Every element and attribute of a document is checked once. The reader reads the elements in :data:`_READ`. Elements in
:data:`_LEFT_OUT` are ignored, and the note refers to a rule for this kind of element. All other elements are ignored,
and the note refers to the rule ``unknown``.
"""

from __future__ import annotations

from frobs_models.notes import Notes
from frobs_models.xmltree import Element

_ORIGIN = {"origin": "xyz rpy quat_xyzw"}
_GEOMETRY = {
    "box": "size",
    "sphere": "radius",
    "cylinder": "radius length",
    "capsule": "radius length",
    "mesh": "filename scale",
}

_READ: dict[str, dict[str, str]] = {
    "robot": {"link": "name", "joint": "name type", "material": "name"},
    "link": {"inertial": "", "visual": "name", "collision": "name"},
    "joint": {
        **_ORIGIN,
        "parent": "link",
        "child": "link",
        "axis": "xyz",
        "limit": "lower upper effort velocity",
        "dynamics": "damping friction",
        "mimic": "joint multiplier offset",
    },
    "inertial": {**_ORIGIN, "mass": "value", "inertia": "ixx ixy ixz iyy iyz izz"},
    "visual": {**_ORIGIN, "geometry": "name", "material": "name"},
    "collision": {**_ORIGIN, "geometry": "name"},
    "geometry": _GEOMETRY,
    "material": {"color": "rgba"},
}
"""Child elements that are read, with their attributes, by parent element."""

_LEFT_OUT = {
    ("robot", "gazebo"): "gazebo",
    ("robot", "transmission"): "transmission",
    ("robot", "ros2_control"): "ros-control",
    ("robot", "sensor"): "sensor",
    ("robot", "mujoco"): "engine-settings",
    ("robot", "drake"): "engine-settings",
    ("link", "contact"): "contact-parameters",
    ("link", "surface"): "contact-parameters",
    ("collision", "contact_coefficients"): "contact-parameters",
    ("collision", "verbose"): "no-effect",
    ("collision", "material"): "no-effect",
    ("link", "origin"): "no-effect",
    ("joint", "safety_controller"): "safety-controller",
    ("joint", "calibration"): "calibration",
    ("material", "texture"): "texture",
}
"""Rules for ignored child elements, by parent and child element."""


def note_what_is_left_out(root: Element, notes: Notes) -> None:
    """Add a note for each kind of element and attribute that the reader ignores.

    Raises:
        ModelFileError: The document contains xacro macros that have not been expanded.
    """
    elements: dict[tuple[str, str, str], list[Element]] = {}
    attributes: dict[tuple[str, str], list[Element]] = {}
    waiting = [root]
    while waiting:
        parent = waiting.pop()
        known = _READ.get(parent.tag, {})
        for child in parent.children():
            if child.tag.startswith("xacro:"):
                child.refuse("the file contains xacro macros; rename it so that its name ends in '.urdf.xacro'.")
            if child.tag not in known:
                rule = _LEFT_OUT.get((parent.tag, child.tag), "unknown")
                elements.setdefault((rule, parent.tag, child.tag), []).append(child)
                continue
            for attribute in child.attrib:
                if attribute not in known[child.tag].split():
                    attributes.setdefault((child.tag, attribute), []).append(child)
            waiting.append(child)
    for (rule, parent_tag, tag), found in elements.items():
        where = "" if parent_tag == "robot" else f" in <{parent_tag}>"
        names = [name for name in (element.get("name") or element.get("reference") for element in found) if name]
        which = f": {', '.join(dict.fromkeys(names))}" if names else ""
        notes.add(rule, found[0], f"{_count(found, f'<{tag}>')}{where}, ignored{which}")
    for (tag, attribute), found in attributes.items():
        notes.add("unknown", found[0], f"the attribute '{attribute}' of {_count(found, f'<{tag}>')}, ignored")


def _count(found: list[Element], what: str) -> str:
    return f"one {what}" if len(found) == 1 else f"{len(found)} × {what}"
