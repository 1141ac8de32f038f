"""Reads masses and inertias, and repairs values that engines cannot simulate.

Each repair adds a note. A link that has a mass but no inertia is assigned the inertia of a solid sphere with a radius
of 5 cm. If a principal moment is negative or exceeds the sum of the other two, all three are replaced by their mean, as
MuJoCo does with ``balanceinertia``. A moving link without any mass is assigned a mass of 1 g and moments of inertia of
10⁻⁶ kg·m². If the mean of the principal moments is 0 or negative, an error is raised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from frobs_core.models import Inertial, Joint, JointType, Pose, symmetric_matrix
from frobs_models.limits import MAX_INERTIA, MAX_MASS
from frobs_models.notes import Notes
from frobs_models.urdf.shapes import read_pose
from frobs_models.xmltree import Element

_KEYS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_RADIUS = 0.05  # [m]
_MASS = 0.001  # [kg]
_MOMENT = 1e-6  # [kg·m²]
_ROUNDING = 1e-9
_THINNEST = 1e-6  # minimum ratio of the smallest to the largest principal moment; engines require moments above 0
_LEAST_GYRATION = 1e-6  # [m] minimum radius of gyration; engines divide by inertias


def read_inertials(links: Mapping[str, Element], joints: Sequence[Joint], notes: Notes) -> dict[str, Inertial | None]:
    """Return the inertial properties of each link. Repaired values are also written to the XML elements.

    Raises:
        ModelFileError: A mass or a moment is negative or not finite.
    """
    inertials = {name: _read(name, element, notes) for name, element in links.items()}
    fixed = {joint.child: joint.parent for joint in joints if joint.type == JointType.FIXED}
    bodies: dict[str, list[str]] = {}  # names of the links in each rigid group, by the name of the group's first link
    for name in links:
        first = name
        while first in fixed:
            first = fixed[first]
        bodies.setdefault(first, []).append(name)
    for joint in joints:
        if joint.type != JointType.FIXED and all(inertials[link] is None for link in bodies[joint.child]):
            moments = (_MOMENT, 0.0, 0.0, _MOMENT, 0.0, _MOMENT)
            inertials[joint.child] = Inertial(_MASS, Pose(), moments)
            _write(links[joint.child], _MASS, moments)
            notes.add("no-mass", links[joint.child], f"the link moves but has no mass; a mass of {_MASS:g} kg is used")
    return inertials


def _read(name: str, link: Element, notes: Notes) -> Inertial | None:
    element = link.child("inertial")
    if element is None:
        return None
    mass_element = element.child("mass")
    mass = mass_element.number("value", limit=MAX_MASS) if mass_element is not None else 0.0
    if mass < 0.0:
        element.refuse(f"link '{name}' has a mass of {mass:g} kg.")
    inertia = element.child("inertia")
    moments = tuple(inertia.number(key, "0", MAX_INERTIA) for key in _KEYS) if inertia is not None else (0.0,) * 6
    if mass == 0.0:
        notes.add("zero-mass", link, "the link has a mass of 0; its <inertial> is ignored")
        link.remove(element)
        return None
    moments = _possible(link, mass, moments, element, notes)
    ixx, ixy, ixz, iyy, iyz, izz = moments
    return Inertial(mass, read_pose(element), (ixx, ixy, ixz, iyy, iyz, izz))


def _possible(
    link: Element, mass: float, moments: tuple[float, ...], element: Element, notes: Notes
) -> tuple[float, ...]:
    principal = np.linalg.eigvalsh(symmetric_matrix(moments))  # ascending
    if np.abs(principal).max() <= _LEAST_GYRATION**2 * mass:
        moments = (moment := 0.4 * mass * _RADIUS**2, 0.0, 0.0, moment, 0.0, moment)
        notes.add(
            "no-inertia",
            link,
            f"the link has a mass but no inertia; the inertia of a solid sphere with a radius of {_RADIUS:g} m is used",
        )
    elif principal[0] < -_ROUNDING * principal[2] or principal[2] > (principal[0] + principal[1]) * (1 + _ROUNDING):
        if (moment := float(principal.mean())) <= 0.0:
            element.refuse(
                f"link '{link.get('name')}' has the principal moments of inertia "
                f"{', '.join(f'{value:g}' for value in principal)} kg·m², which are physically impossible; correct "
                "its <inertia>."
            )
        moments = (moment, 0.0, 0.0, moment, 0.0, moment)
        text = "the link has an impossible inertia; the mean of its principal moments is used"
        notes.add("impossible-inertia", link, text)
    elif principal[0] < _THINNEST * principal[2]:
        axes = np.linalg.eigh(symmetric_matrix(moments))[1]
        raised = axes @ np.diag(np.maximum(principal, _THINNEST * principal[2])) @ axes.T
        moments = tuple(raised[np.triu_indices(3)].tolist())
        notes.add(
            "thin-inertia",
            link,
            f"the link's principal moment of inertia of {principal[0]:g} kg·m² is too small and was increased",
        )
    else:
        return moments
    link_inertia = element.child("inertia")
    if link_inertia is not None:
        element.remove(link_inertia)
    element.append(_element("inertia", dict(zip(_KEYS, map(repr, moments), strict=True)), element))
    return moments


def _write(link: Element, mass: float, moments: Sequence[float]) -> None:
    inertial = _element("inertial", {}, link)
    inertial.append(_element("mass", {"value": repr(mass)}, link))
    inertial.append(_element("inertia", dict(zip(_KEYS, map(repr, moments), strict=True)), link))
    link.insert(0, inertial)


def _element(tag: str, attributes: dict[str, str], beside: Element) -> Element:
    element = Element(tag, attributes)
    element.file, element.line = beside.file, beside.line
    return element
