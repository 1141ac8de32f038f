"""Shapes, colors and poses in URDF."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias

from frobs_core.models import Box, Capsule, Collision, Cylinder, Geometry, Mesh, Pose, Sphere, Visual
from frobs_core.util.errors import ModelFileError
from frobs_core.util.rotations import quat_from_rpy
from frobs_models.limits import MAX_LENGTH
from frobs_models.notes import Notes
from frobs_models.resources import Packages
from frobs_models.xmltree import Element, parse_numbers

SHAPES = ("box", "sphere", "cylinder", "capsule", "mesh")

Rgba: TypeAlias = tuple[float, float, float, float]


def read_pose(element: Element) -> Pose:
    """Return the pose that an element's ``<origin>`` defines."""
    origin = element.child("origin")
    if origin is None:
        return Pose()
    x, y, z = origin.numbers("xyz", 3, "0 0 0", MAX_LENGTH)
    if "quat_xyzw" in origin.attrib:
        if "rpy" in origin.attrib:
            origin.refuse("the orientation is specified twice, as rpy and as quat_xyzw; remove one of them.")
        i, j, k, w = origin.numbers("quat_xyzw", 4)
        length = math.sqrt(w * w + i * i + j * j + k * k)
        if length < 1e-9:
            origin.refuse("the quaternion is zero.")
        return Pose((x, y, z), (w / length, i / length, j / length, k / length))
    w, i, j, k = quat_from_rpy(origin.numbers("rpy", 3, "0 0 0")).tolist()
    return Pose((x, y, z), (w, i, j, k))


class Shapes:
    """Reads visual and collision elements and makes their mesh paths absolute."""

    def __init__(self, packages: Packages, materials: Iterable[Element], notes: Notes) -> None:
        self.packages = packages
        self.colours: dict[str, Rgba | None] = {}
        self.notes = notes
        for material in materials:
            self._define(material, material.required("name"), read_colour(material, notes))

    def _define(self, material: Element, name: str, rgba: Rgba | None) -> Rgba | None:
        """Store and return the color of a material. As in ROS, the first definition of a material applies."""
        first = self.colours.setdefault(name, rgba)
        if first != rgba:
            text = f"the material '{name}' is defined again with another color; the first definition is used"
            self.notes.add("repeated-material", material, text)
        return first

    def present(self, link: Element, tag: str) -> list[Element]:
        """Return the ``<visual>`` or ``<collision>`` elements of a link.

        Spheres with a radius of 0 and visuals whose mesh file is missing are removed from the link.
        """
        elements = []
        for element in list(link.children(tag)):
            if any(_is_zero(sphere.get("radius", "")) for sphere in element.descendants("sphere")):
                self.notes.add("empty-shape", link, f"a <{tag}> that contains a sphere of radius 0 is ignored")
                link.remove(element)
            elif tag == "visual" and (file := self._missing(element)):
                self.notes.add("missing-visual", link, f"a visual is not drawn, because {file} does not exist")
                link.remove(element)
            else:
                elements.append(element)
        return elements

    def _missing(self, element: Element) -> Path | None:
        """Return where the mesh file of a ``<visual>`` should be, or None if no file is missing."""
        files = (mesh.get("filename", "") for mesh in element.descendants("mesh"))
        return next(
            (path for uri in files if uri and (path := self.packages.missing(uri, self.packages.file.parent))), None
        )

    def visual(self, element: Element) -> Visual:
        """Read a ``<visual>``."""
        material = element.child("material")
        rgba = None
        if material is not None:
            rgba = read_colour(material, self.notes)
            name = material.get("name", "")
            if rgba is None:
                if name not in self.colours and not len(material):
                    text = f"the material '{name}' is not defined, so the visual has no color"
                    self.notes.add("undefined-material", element, text)
                rgba = self.colours.get(name)
            elif name:
                rgba = self._define(material, name, rgba)
        return Visual(self.geometry(element), read_pose(element), rgba)

    def collision(self, element: Element) -> Collision:
        """Read a ``<collision>``."""
        return Collision(self.geometry(element), read_pose(element))

    def geometry(self, element: Element) -> Geometry:
        """Read the shape of a ``<visual>`` or ``<collision>``."""
        holder = element.child("geometry")
        given = [] if holder is None else list(holder.children())
        shapes = [shape for shape in given if shape.tag in SHAPES] or given
        if len(shapes) != 1:
            element.refuse("the element must contain exactly one <geometry> with exactly one shape.")
        shape = shapes[0]
        match shape.tag:
            case "box":
                x, y, z = shape.numbers("size", 3, limit=MAX_LENGTH)
                return Box((_positive(shape, x), _positive(shape, y), _positive(shape, z)))
            case "sphere":
                return Sphere(_length(shape, "radius"))
            case "cylinder":
                return Cylinder(_length(shape, "radius"), _length(shape, "length"))
            case "capsule":
                return Capsule(_length(shape, "radius"), _length(shape, "length"))
            case "mesh":
                return self.mesh(shape)
        return shape.refuse(f"is not a URDF shape; available: {', '.join(SHAPES)}.")

    def mesh(self, shape: Element) -> Mesh:
        """Read a ``<mesh>`` and find its file."""
        x, y, z = shape.numbers("scale", 3, "1 1 1", MAX_LENGTH)
        if 0.0 in (x, y, z):
            shape.refuse("the scale is 0.")
        uri = shape.required("filename")
        try:
            file = self.packages.resolve(uri, self.packages.file.parent)
        except ModelFileError as error:
            shape.refuse(f"the mesh '{uri}' cannot be used: {error.reason}")
        shape.set("filename", str(file))
        return Mesh(file, (x, y, z))


def _is_zero(text: str) -> bool:
    try:
        return parse_numbers(text) == (0.0,)
    except ValueError:
        return False  # the invalid number is reported later, when it is read


def _positive(element: Element, number: float) -> float:
    return number if number > 0.0 else element.refuse(f"sizes must be > 0, not {number:g}.")


def _length(element: Element, attribute: str) -> float:
    return _positive(element, element.number(attribute, limit=MAX_LENGTH))


def read_colour(material: Element, notes: Notes) -> Rgba | None:
    """Return the color that a ``<material>`` defines, or None if it only refers to a material by name."""
    colour = material.child("color")
    if colour is None:
        return None
    values = colour.numbers("rgba", 4)
    clipped = [min(1.0, max(0.0, value)) for value in values]
    if list(values) != clipped:
        notes.add("colour-clipped", material, f"rgba {colour.get('rgba')} is clipped to [0, 1]")
    r, g, b, a = clipped
    return r, g, b, a
