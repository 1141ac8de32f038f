"""Masses of MJCF bodies, as far as the core needs them: for drive gains. The engine computes its own."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.models.kinematics import compose
from frobs_core.models.limits import MAX_MASS
from frobs_core.models.mjcf_document import MjcfDocument, shortest_from_z
from frobs_core.models.model import Inertial, Pose
from frobs_core.models.xmltree import Element
from frobs_core.rotations import matrix_from_quat

_SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}


def body_inertial(document: MjcfDocument, body: Element, geoms: Sequence[tuple[Element, Floats]]) -> Inertial | None:
    """Return what a body weighs: its ``<inertial>``, else the sum of its primitive geoms, else None.

    Args:
        document: Its document.
        body: The body.
        geoms: Its geoms, defaults filled in, each with the pose (7,) of the frame that it stands in.
    """
    element = body.child("inertial")
    if element is not None:
        return _read_inertial(document, element)
    parts = [part for geom, frame in geoms if (part := _geom(document, geom, frame)) is not None]
    mass = sum(part[0] for part in parts)
    if not mass <= MAX_MASS:
        body.refuse(f"its shapes weigh {mass:g} kg; the limit is {MAX_MASS:g} kg.")
    if mass <= 0.0:
        return None
    centre = sum((part[0] * part[1] for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part_mass, pos, moments in parts:
        arm = pos - centre
        inertia += moments + part_mass * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
    x, y, z = centre.tolist()
    return Inertial(mass, Pose((x, y, z)), _six(inertia))


def _read_inertial(document: MjcfDocument, element: Element) -> Inertial:
    x, y, z, w, i, j, k = document.pose(element).tolist()
    mass = element.number("mass")
    if mass < 0.0:
        element.refuse(f"a mass of {mass:g} kg.")
    if "fullinertia" in element.attrib:
        xx, yy, zz, xy, xz, yz = element.numbers("fullinertia", 6)
    else:
        (xx, yy, zz), xy, xz, yz = element.numbers("diaginertia", 3, "0 0 0"), 0.0, 0.0, 0.0
    return Inertial(mass, Pose((x, y, z), (w, i, j, k)), (xx, xy, xz, yy, yz, zz))


def _geom(document: MjcfDocument, geom: Element, frame: Floats) -> tuple[float, Floats, Floats] | None:
    """Return mass, centre (3,) and inertia (3, 3) about it in the body's axes; None: not a primitive solid."""
    kind = geom.get("type", "sphere")
    if kind not in _SIZES:
        return None
    sizes = list(geom.numbers("size"))
    pose = document.pose(geom)
    if "fromto" in geom.attrib and kind != "sphere":
        ends = np.array(geom.numbers("fromto", 6)).reshape(2, 3)
        span = ends[0] - ends[1]  # as MuJoCo does: z points at the first end
        length = math.sqrt(float(span @ span))
        if length == 0.0:
            geom.refuse("the two points of fromto are the same.")
        pose = np.concatenate([ends.mean(axis=0), shortest_from_z(span / length)])
        sizes = sizes[:1] * (_SIZES[kind] - 1) + [0.5 * length]
    if len(sizes) < _SIZES[kind]:
        geom.refuse(f"size needs {_SIZES[kind]} numbers for a {kind}.")
    volume, ratios = _solid(kind, sizes)
    mass = geom.number("mass") if "mass" in geom.attrib else geom.number("density", "1000") * volume
    pose = compose(frame, pose)
    rotation = matrix_from_quat(pose[3:])
    return mass, pose[:3], rotation @ np.diag(mass * ratios) @ rotation.T


def _solid(kind: str, sizes: list[float]) -> tuple[float, Floats]:
    """Return volume [m³] and moments of inertia for a mass of 1 kg, (3,) [m²]."""
    if kind in ("sphere", "ellipsoid"):
        a, b, c = sizes if kind == "ellipsoid" else sizes[:1] * 3
        return 4 / 3 * math.pi * a * b * c, np.array([b * b + c * c, a * a + c * c, a * a + b * b]) / 5
    if kind == "box":
        a, b, c = sizes[:3]
        return 8 * a * b * c, np.array([b * b + c * c, a * a + c * c, a * a + b * b]) / 3
    r, h = sizes[:2]  # radius and half length
    tube = 2 * math.pi * r * r * h
    across, along = r * r / 4 + h * h / 3, r * r / 2
    if kind == "cylinder":
        return tube, np.array([across, across, along])
    ball = 4 / 3 * math.pi * r**3
    total = tube + ball
    # a half ball's centre is 3/8 r beyond the tube's end
    cap_across = 0.4 * r * r + h * h + 0.75 * h * r
    return total, np.array(
        [(tube * across + ball * cap_across) / total] * 2 + [(tube * along + ball * 0.4 * r * r) / total]
    )


def _six(inertia: Floats) -> tuple[float, float, float, float, float, float]:
    (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = inertia.tolist()
    return ixx, ixy, ixz, iyy, iyz, izz
