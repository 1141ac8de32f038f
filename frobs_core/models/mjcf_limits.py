"""Checks an MJCF document, before MuJoCo reads it, for content that could exhaust memory or take too long to load."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from frobs_core.files import check_regular
from frobs_core.models.limits import MAX_COEFFICIENT, MAX_INERTIA, MAX_LENGTH, MAX_MASS
from frobs_core.models.mesh_files import MAX_BYTES
from frobs_core.models.xmltree import Element

MAX_PIXELS = 2**24
"""Maximum total number of texture pixels in a file, and maximum total number of height field cells."""

MAX_COUNTS: Mapping[str, int] = {"geom": 3_000, "site": 5_000, "joint": 2_000, "camera": 500, "light": 500}
"""Maximum number of elements, by tag."""

MAX_MJCF_ELEMENTS = 20_000
"""Maximum number of elements in an MJCF file, including the files that it includes."""

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


def check_numbers(root: Element) -> None:
    """Check the number of elements and the values of their attributes.

    Raises:
        ModelFileError: A limit is exceeded.
    """
    counts = Counter(element.tag for element in root.iter())
    if counts.total() > MAX_MJCF_ELEMENTS:
        root.refuse(f"the file has {counts.total():,} elements; the limit is {MAX_MJCF_ELEMENTS:,}.")
    for tag, most in MAX_COUNTS.items():
        if counts[tag] > most:
            root.refuse(f"the file has {counts[tag]:,} <{tag}> elements; the limit is {most:,}.")
    for tag in _PHYSICAL:
        for element in root.descendants(tag):
            for attribute, limit in _LIMITS.items():
                if attribute in element.attrib:
                    element.numbers(attribute, limit=limit)
    for mesh in root.descendants("mesh"):
        if "builtin" in mesh.attrib and "params" in mesh.attrib:
            mesh.numbers("params", limit=MAX_MESH_PARAMETER)
    _check_areas(root)


def _check_areas(root: Element) -> None:
    """Check the numbers of pixels and cells that are declared in the document itself."""
    for tag, width, height in (("hfield", "ncol", "nrow"), ("texture", "width", "height")):
        total = 0.0
        for element in root.descendants(tag):
            wide, high = element.number(width, "0"), element.number(height, "0")
            if tag == "texture" and element.get("type", "cube") != "2d":
                high = max(high, wide * _FACES_OF_A_CUBE)
            total += max(0.0, wide) * max(0.0, high)
            _check_area(element, total)


def check_asset(element: Element, file: Path, pixels: float) -> float:
    """Check a file that MuJoCo will open.

    Args:
        element: Element that refers to the file.
        file: The file.
        pixels: Total number of pixels or cells in the files checked so far.

    Returns:
        Total number of pixels or cells, including this file.

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
        return pixels
    if head[:4] == b"\x89PNG" and len(head) == 24:
        wide, high = struct.unpack(">II", head[16:24])
    elif len(head) >= 8:
        wide, high = struct.unpack("<ii", head[:8])  # MuJoCo's own formats
    else:
        wide = high = 0
    pixels += max(0, wide) * max(0, high)
    _check_area(element, pixels)
    return pixels


def _check_area(element: Element, total: float) -> None:
    if total > MAX_PIXELS:
        what = "cells of the height fields" if element.tag == "hfield" else "pixels of the textures"
        element.refuse(f"there are {total:,.0f} {what}; the limit is {MAX_PIXELS:,}.")
