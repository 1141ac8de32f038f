"""Shapes and masses of MJCF bodies: collision shapes, visuals and inertials, computed as in MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from frobs_core.models import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Inertial,
    Link,
    Mesh,
    Pose,
    Sphere,
    Visual,
    compose,
    inertia_matrix,
    parallel_axis,
    pose_from_array,
    solid,
)
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat
from frobs_models.limits import MAX_MASS
from frobs_models.mjcf.document import MjcfDocument, shortest_from_z
from frobs_models.xmltree import Element

_SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}


@dataclass(frozen=True, eq=False)
class Geom:
    """A geom of a body.

    Attributes:
        geometry: Shape of the geom, or None for shapes that only MuJoCo supports, such as ellipsoids and height fields.
        pose: Pose in the body's frame, (7,).
        collides: Whether the geom collides.
        rgba: Color of the geom, or None.
        group: Number of the geom's group.
        mass: Mass [kg], or NaN if only MuJoCo can compute the mass.
        inertia: Inertia about the geom's center in the geom's axes, for a mass of 1 kg, (3, 3) [m²].
    """

    geometry: Geometry | None
    pose: Floats
    collides: bool
    rgba: tuple[float, float, float, float] | None
    group: int
    mass: float
    inertia: Floats


def read_geom(document: MjcfDocument, geom: Element, frame: Floats) -> Geom:
    """Read a geom.

    Raises:
        ModelFileError: The geom's size is missing.
    """
    kind = geom.get("type", "sphere")
    pose, size = _placed(document, geom, kind)
    geometry = _geometry(document, geom, kind, size)
    volume, inertia = math.nan, np.zeros((3, 3))
    if kind == "ellipsoid" and len(size) == 3:
        a, b, c = np.square(size).tolist()
        volume, inertia = 4 / 3 * math.pi * math.prod(size), np.diag([b + c, a + c, a + b]) / 5
    elif geometry is not None and not isinstance(geometry, Mesh) and geom.get("shellinertia", "false") != "true":
        volume, _, inertia = solid(geometry)
    if kind in ("plane", "hfield"):
        mass = 0.0
    elif "mass" in geom.attrib:
        mass = geom.number("mass")
        if mass and math.isnan(volume):
            mass = math.nan  # unknown center of mass
    else:
        density = geom.number("density", "1000")
        mass = density * volume if density else 0.0
    collides = geom.get("contype", "1") != "0" or geom.get("conaffinity", "1") != "0"
    rgba = None
    if "rgba" in geom.attrib:
        red, green, blue, alpha = geom.numbers("rgba", 4)
        rgba = red, green, blue, alpha
    return Geom(geometry, compose(frame, pose), collides, rgba, int(geom.number("group", "0")), mass, inertia)


def _placed(document: MjcfDocument, geom: Element, kind: str) -> tuple[Floats, list[float]]:
    """Return a geom's pose in its parent, (7,), and the geom's sizes."""
    size = list(geom.numbers("size")) if "size" in geom.attrib else []
    pose = document.pose(geom)
    if kind not in _SIZES or "mesh" in geom.attrib:
        return pose, size
    if "fromto" in geom.attrib and kind != "sphere":
        ends = np.array(geom.numbers("fromto", 6)).reshape(2, 3)
        span = ends[0] - ends[1]  # as in MuJoCo, the z axis points to the first end
        length = math.sqrt(float(span @ span))
        if length == 0.0:
            geom.refuse("the attribute 'fromto' contains the same point twice; specify two different points.")
        pose = np.concatenate([ends.mean(axis=0), shortest_from_z(span / length)])
        size = size[:1] * (_SIZES[kind] - 1) + [0.5 * length]
    if len(size) < _SIZES[kind]:
        geom.refuse(f"size needs {_SIZES[kind]} numbers for a {kind}.")
    return pose, size[: _SIZES[kind]]


def _geometry(document: MjcfDocument, geom: Element, kind: str, size: Sequence[float]) -> Geometry | None:
    if kind == "mesh":
        asset = document.meshes.get(geom.get("mesh", ""))
        if asset is None or not asset.get("file") or "refpos" in asset.attrib or "refquat" in asset.attrib:
            return None
        x, y, z = asset.numbers("scale", 3, "1 1 1")
        return Mesh(Path(asset.required("file")), (x, y, z))
    if "mesh" in geom.attrib:
        return None  # MuJoCo fits this primitive to the mesh
    match kind:
        case "box":
            x, y, z = size
            return Box((2.0 * x, 2.0 * y, 2.0 * z))
        case "sphere":
            return Sphere(size[0])
        case "capsule":
            return Capsule(size[0], 2.0 * size[1])
        case "cylinder":
            return Cylinder(size[0], 2.0 * size[1])
    return None


def body_link(name: str, geoms: Sequence[Geom]) -> Link:
    """Return a body's link without mass properties."""
    visuals, collisions = [], []
    for geom in geoms:
        if geom.geometry is not None:
            if geom.collides:
                collisions.append(Collision(geom.geometry, pose_from_array(geom.pose)))
            else:
                visuals.append(Visual(geom.geometry, pose_from_array(geom.pose), geom.rgba))
    return Link(name, visuals=tuple(visuals), collisions=tuple(collisions))


def body_inertial(document: MjcfDocument, body: Element, geoms: Sequence[Geom]) -> Inertial | None:
    """Return a body's inertial, or None.

    The compiler settings determine whether the inertial is read from ``<inertial>`` or summed over the geoms.
    """
    source = document.compiler.get("inertiafromgeom", "auto")
    element = body.child("inertial")
    if element is not None and source != "true":
        return _read_inertial(document, element)
    if source == "false":
        return None
    heavy = weighed(document, geoms)
    mass = sum(geom.mass for geom in heavy)
    if mass > MAX_MASS:
        body.refuse(f"the shapes of the body have a total mass of {mass:g} kg; the limit is {MAX_MASS:g} kg.")
    if not mass > 0.0:  # zero or unknown
        return None
    center = sum((geom.mass * geom.pose[:3] for geom in heavy), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for geom in heavy:
        turn = matrix_from_quat(geom.pose[3:])
        inertia += turn @ (geom.mass * geom.inertia) @ turn.T + parallel_axis(geom.mass, geom.pose[:3] - center)
    x, y, z = center.tolist()
    return Inertial(mass, Pose((x, y, z)), _six(inertia))


def weighed(document: MjcfDocument, geoms: Sequence[Geom]) -> list[Geom]:
    """Return the geoms that contribute to a body's mass."""
    low, high = document.compiler.numbers("inertiagrouprange", 2, "0 5")
    return [geom for geom in geoms if low <= geom.group <= high and geom.mass]


def _read_inertial(document: MjcfDocument, element: Element) -> Inertial:
    mass = element.number("mass")
    if mass < 0.0:
        element.refuse(f"the mass is {mass:g} kg.")
    if "fullinertia" in element.attrib:
        xx, yy, zz, xy, xz, yz = element.numbers("fullinertia", 6)
    else:
        (xx, yy, zz), xy, xz, yz = element.numbers("diaginertia", 3, "0 0 0"), 0.0, 0.0, 0.0
    return Inertial(mass, pose_from_array(document.pose(element)), (xx, xy, xz, yy, yz, zz))


def compiled_inertials(compiler: Element, inertials: Mapping[str, Inertial | None]) -> dict[str, Inertial | None]:
    """Return the inertials of all bodies after applying the compiler's mass and inertia settings."""
    least_mass, least_moment, total = (
        compiler.number(name, "0") for name in ("boundmass", "boundinertia", "settotalmass")
    )
    balanced = compiler.get("balanceinertia", "false") == "true"
    changed = dict(inertials)
    if least_mass > 0.0 or least_moment > 0.0 or balanced:
        for name, inertial in inertials.items():
            inertial = inertial or Inertial(0.0, Pose(), (0.0,) * 6)
            moments, axes = np.linalg.eigh(inertia_matrix(inertial))
            moments = np.maximum(moments, least_moment)
            if balanced and moments[0] + moments[1] < moments[2]:
                moments = np.full(3, moments.mean())
            mass = max(inertial.mass, least_mass)
            if mass > 0.0:
                six = _six(axes @ np.diag(moments) @ axes.T)
                changed[name] = Inertial(mass, Pose(inertial.origin.pos), six)
    if total > 0.0:
        weight = sum(inertial.mass for inertial in changed.values() if inertial is not None)
        share = total / weight if weight else 0.0
        for name, inertial in changed.items():
            if inertial is not None:
                xx, xy, xz, yy, yz, zz = (share * moment for moment in inertial.inertia)
                changed[name] = replace(inertial, mass=share * inertial.mass, inertia=(xx, xy, xz, yy, yz, zz))
    return changed


def _six(inertia: Floats) -> tuple[float, float, float, float, float, float]:
    (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = inertia.tolist()
    return ixx, ixy, ixz, iyy, iyz, izz
