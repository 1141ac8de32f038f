"""Collision and visual shapes in SDF."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from frobs_core.models import Box, Cylinder, Geometry, Mesh, Sphere
from frobs_core.util.errors import ModelFileError
from frobs_models import Element, Packages
from frobs_ros.bridge.poses import Place
from frobs_ros.bridge.sdf.reading import check, number_of, numbers_of, place_of, text_of

_SHAPES = ("box", "cylinder", "sphere", "mesh", "plane")
_THICKNESS = 0.1  # thickness [m] of the box that replaces a plane; the plane becomes the top face of the box
_GREY = (0.7, 0.7, 0.72, 1.0)


@dataclass(frozen=True)
class Shape:
    """A collision shape or a visual shape of a link.

    Attributes:
        place: Pose of the shape in the link frame.
        friction: Sliding friction coefficient, or None if the file does not specify friction.
        is_ground: Whether the shape replaces a plane.
    """

    name: str
    geometry: Geometry
    place: Place
    rgba: tuple[float, float, float, float] = _GREY
    friction: float | None = None
    is_ground: bool = False


def read_collision(element: Element) -> Shape:
    """Read a ``<collision>`` element.

    Only the friction in ``<surface>`` is used, because the other surface parameters are specific to ODE.

    Raises:
        ModelFileError: An element is not supported.
    """
    check(element, ("pose", "geometry", "surface"), ("max_contacts", "laser_retro"))
    surface = element.child("surface")
    if surface is not None:
        check(surface, ("friction",), ("contact", "bounce", "soft_contact"))
    mu = text_of(element, "surface/friction/ode/mu")
    friction = min(number_of(element, "surface/friction/ode/mu", 1.0), 10.0) if mu else None
    return _shape(element, friction=friction)


def read_visual(element: Element) -> Shape:
    """Read a ``<visual>`` element. Only the colors in ``<material>`` are used.

    Raises:
        ModelFileError: An element is not supported.
    """
    passed_over = ("cast_shadows", "transparency", "meta", "laser_retro", "plugin", "visibility_flags")
    check(element, ("pose", "geometry", "material"), passed_over)
    path = next((path for path in ("material/diffuse", "material/ambient") if text_of(element, path)), "")
    colour = numbers_of(element, path, "0 0 0 1") if path else _GREY
    r, g, b, a = (min(1.0, max(0.0, value)) for value in colour)
    return _shape(element, rgba=(r, g, b, a))


def _shape(element: Element, friction: float | None = None, rgba: tuple[float, float, float, float] = _GREY) -> Shape:
    holder = element.child("geometry")
    shapes = [] if holder is None else list(holder.children())
    if len(shapes) != 1:
        element.refuse("the element must contain one <geometry> with exactly one shape.")
    form = shapes[0]
    if form.tag not in _SHAPES:
        form.refuse(f"the shape <{form.tag}> is not supported; supported shapes: {', '.join(_SHAPES)}.")
    place = place_of(element)
    name = element.required("name")
    if form.tag == "plane":
        normal = np.array(numbers_of(form, "normal", "0 0 1"))
        if not np.allclose(normal, (0.0, 0.0, 1.0)):
            form.refuse(
                f"the plane has the normal {normal.tolist()}, but it must be 0 0 1; rotate the plane with <pose>."
            )
        x, y = numbers_of(form, "size", "100 100")
        below = Place(np.array([0.0, 0.0, -_THICKNESS / 2.0]), np.array([1.0, 0.0, 0.0, 0.0]))
        return Shape(name, Box((x, y, _THICKNESS)), below.after(place), rgba, friction, is_ground=True)
    return Shape(name, _geometry(form), place, rgba, friction)


def _geometry(form: Element) -> Geometry:
    if form.tag == "box":
        x, y, z = numbers_of(form, "size", "1 1 1")
        return Box((_positive(form, x), _positive(form, y), _positive(form, z)))
    if form.tag == "sphere":
        return Sphere(_positive(form, number_of(form, "radius", 0.0)))
    if form.tag == "cylinder":
        return Cylinder(
            _positive(form, number_of(form, "radius", 0.0)), _positive(form, number_of(form, "length", 0.0))
        )
    check(form, ("uri", "scale"))
    x, y, z = numbers_of(form, "scale", "1 1 1")
    try:
        return Mesh(Packages(None, form.file).resolve(text_of(form, "uri"), form.file.parent), (x, y, z))
    except ModelFileError as error:
        return form.refuse(f"the mesh '{text_of(form, 'uri')}' cannot be used: {error.reason}")


def _positive(form: Element, number: float) -> float:
    return number if number > 0.0 else form.refuse(f"expected a size above 0, got {number:g}.")
