"""Checks an MJCF document, before MuJoCo reads it, for content that could exhaust memory or take too long to load."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from frobs_core.util.budgets import Meter
from frobs_core.util.files import check_regular
from frobs_models.limits import MAX_COEFFICIENT, MAX_INERTIA, MAX_LENGTH, MAX_MASS
from frobs_models.meshes.files import MAX_BYTES
from frobs_models.xmltree import Element

MAX_MESH_PARAMETER = 200
"""Maximum absolute value of a parameter of a generated mesh (``<mesh builtin="…" params="…"/>``)."""

_LIMITS: Mapping[str, float] = {
    "mass": MAX_MASS,
    "diaginertia": MAX_INERTIA,
    "fullinertia": MAX_INERTIA,
    **dict.fromkeys(("size", "pos", "fromto", "scale", "ref", "refpos"), MAX_LENGTH),
    **dict.fromkeys(("density", "armature", "damping", "stiffness", "frictionloss", "gear", "coef"), MAX_COEFFICIENT),
}
_PHYSICAL = ("geom", "inertial", "joint", "body", "frame", "site", "mesh", "hfield", "freejoint", "tendon", "general")
_FACES_OF_A_CUBE = 6
_AREAS = {"hfield": "cells of height fields", "texture": "pixels of textures"}


def check_numbers(root: Element, meter: Meter) -> None:
    """Check the number of elements and the values of their attributes."""
    counts = Counter(element.tag for element in root.iter())
    meter.spend("MJCF elements", counts.total())
    for tag in ("geom", "site", "joint", "camera", "light"):
        meter.spend(f"<{tag}> elements", counts[tag])
    for section in root.children("actuator"):
        meter.spend("actuators", len(section))
    for tag in _PHYSICAL:
        for element in root.descendants(tag):
            for attribute, limit in _LIMITS.items():
                if attribute in element.attrib:
                    element.numbers(attribute, limit=limit)
    for mesh in root.descendants("mesh"):
        if "builtin" in mesh.attrib and "params" in mesh.attrib:
            mesh.numbers("params", limit=MAX_MESH_PARAMETER)
    _check_areas(root, meter)


def _check_areas(root: Element, meter: Meter) -> None:
    """Check the numbers of pixels and cells that are declared in the document itself."""
    for tag, width, height in (("hfield", "ncol", "nrow"), ("texture", "width", "height")):
        for element in root.descendants(tag):
            wide, high = element.number(width, "0"), element.number(height, "0")
            if tag == "texture" and element.get("type", "cube") != "2d":
                high = max(high, wide * _FACES_OF_A_CUBE)
            meter.spend(_AREAS[tag], int(max(0.0, wide) * max(0.0, high)))


def check_asset(element: Element, file: Path, meter: Meter) -> None:
    """Check a file that MuJoCo will open.

    Raises:
        ModelFileError: The file is not a regular file or exceeds a limit.
    """
    try:
        check_regular(file, MAX_BYTES)
        with open(file, "rb") as opened:
            head = opened.read(24)
    except OSError as error:
        element.refuse(f"the file '{file}' cannot be used: {error.strerror}.")
    if element.tag not in ("texture", "hfield"):
        return
    if head[:4] == b"\x89PNG" and len(head) == 24:
        wide, high = struct.unpack(">II", head[16:24])
    elif len(head) >= 8:
        wide, high = struct.unpack("<ii", head[:8])  # MuJoCo's own formats
    else:
        wide = high = 0
    meter.spend(_AREAS[element.tag], max(0, wide) * max(0, high))
