"""Checks whether each link's mass and inertia are plausible for the link's shape."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np

from frobs_core.models import MOVING, Collision, Inertial, Link, Mesh, RobotModel, Visual, inertia_matrix
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_devkit.doctor.robot_report import Finding, LinkFacts, Severity, warning
from frobs_models import link_bounds, shape_points, shapes_points

DENSITIES = (1.0, 20_000.0)
"""Range of plausible link densities, from foam to tungsten: mass divided by bounding box volume [kg/m³]."""

_AXES, _MOMENTS = "xyz", ("ixx", "iyy", "izz")
_TURNED = 3.0  # minimum ratio between the moments about two axes that indicates a rotated inertia
_LEAST, _MOST = 0.02, 2.0  # range of plausible moments, relative to the maximum for a body inside the box
_SMALL = 1e-3  # [m] minimum edge length of a bounding box, so that a flat sheet has a nonzero volume
_SHARE = 0.005  # fraction of the robot's total mass or inertia below which a link has no visible effect
_LARGE = 20.0  # [m] a link larger than this usually has a mesh in millimeters


def link_facts(model: RobotModel) -> tuple[LinkFacts, ...]:
    """Return the facts about every link."""
    return tuple(_facts(link) for link in model.links)


def _facts(link: Link) -> LinkFacts:
    inertial, bounds = link.inertial, link_bounds(link)
    moments = None if inertial is None else np.linalg.eigvalsh(inertia_matrix(inertial))
    return LinkFacts(
        name=link.name,
        mass=None if inertial is None else inertial.mass,
        center_of_mass=None if inertial is None else inertial.origin.pos,
        principal_moments=None if moments is None else tuple(moments.tolist()),
        visuals=len(link.visuals),
        collisions=len(link.collisions),
        size=None if bounds is None else tuple((bounds[1] - bounds[0]).tolist()),
    )


def body_findings(model: RobotModel) -> Iterator[Finding]:
    """Yield findings about the links. Missing collision shapes are only reported for URDF files."""
    significant = is_significant(model)
    assumed = {note.element for note in model.notes if note.rule == "no-mass"}
    for link in model.links:
        yield from _unreadable(link)
        bounds = link_bounds(link)
        if bounds is not None and max(bounds[1] - bounds[0]) > _LARGE:
            yield warning(
                "too-large",
                f"link '{link.name}'",
                f"its shape is {max(bounds[1] - bounds[0]):.3g} m long",
                'a mesh in millimeters needs scale="0.001 0.001 0.001"',
            )
        elif bounds is not None and link.inertial is not None and f'<link name="{link.name}">' not in assumed:
            heavy = significant(link.inertial)
            for finding in _compare(link, link.inertial, *bounds):
                yield finding if heavy else replace(finding, severity=Severity.NOTE)
    if model.format == "urdf":
        yield from _untouchable(model)


def is_significant(model: RobotModel) -> Callable[[Inertial], bool]:
    """Return a function that decides whether a link's mass or inertia has a visible effect on the robot's motion."""
    inertials = [link.inertial for link in model.links if link.inertial is not None]
    light = _SHARE * sum(inertial.mass for inertial in inertials)
    small = _SHARE * sum(float(np.trace(inertia_matrix(inertial))) for inertial in inertials)
    return lambda one: one.mass > light or float(np.trace(inertia_matrix(one))) > small


def _is_outside(center: Floats, points: Floats) -> bool:
    """Return whether a point is farther outside the bounding box of points (n, 3) [m] than half of the box's size."""
    low, high = points.min(axis=0), points.max(axis=0)
    distance = np.maximum(np.maximum(low - center, center - high), 0.0)
    return bool((distance / np.maximum(high - low, _SMALL)).max() > 0.5)


def _unreadable(link: Link) -> Iterator[Finding]:
    shapes: list[Visual | Collision] = [*link.collisions, *link.visuals]
    for shape in shapes:
        if isinstance(shape.geometry, Mesh):
            try:
                shape_points(shape)
            except ModelFileError as error:
                yield warning(
                    "unreadable-mesh",
                    f"link '{link.name}'",
                    f"the mesh '{error.path.name}' cannot be measured: {error.reason.rstrip('.')}",
                    "open the mesh in a mesh viewer and export it again as .stl or .obj",
                )


def _untouchable(model: RobotModel) -> Iterator[Finding]:
    """Yield findings about links with visuals but without collision shapes."""
    if any(link.visuals for link in model.links) and not any(link.collisions for link in model.links):
        yield warning(
            "no-collision",
            f"robot '{model.name}'",
            "no link has a collision shape, so the robot passes through everything",
            "add <collision> shapes to the links, for example copies of their <visual> shapes",
        )
        return
    moved = {joint.child for joint in model.joints if joint.type in MOVING}
    for link in model.links:
        if link.visuals and not link.collisions:
            problem = "the link has visuals but no collision shape"
            advice = "add a <collision> element if the link should collide"
            finding = warning("visual-only", f"link '{link.name}'", problem, advice)
            yield finding if link.name in moved else replace(finding, severity=Severity.NOTE)


def _compare(link: Link, inertial: Inertial, low: Floats, high: Floats) -> Iterator[Finding]:
    """Compare a link's mass and inertia with the bounding box of its shape.

    The moment of inertia of a body inside the box, about its center of mass, is at most m·(b² + c²)/4. This maximum is
    reached if all mass is in the corners. The moment of a solid box is a third of the maximum.
    """
    size = np.maximum(high - low, _SMALL)
    density = inertial.mass / float(np.prod(size))
    edges = " × ".join(f"{edge:.3g}" for edge in size)
    if not DENSITIES[0] <= density <= DENSITIES[1]:
        word = "light" if density < DENSITIES[0] else "heavy"
        yield warning(
            "absurd-mass",
            f"link '{link.name}'",
            f"the link is too {word}: its mass of {inertial.mass:.3g} kg in a box of {edges} m gives a density of "
            f"{density:,.3g} kg/m³",
            "check the mass of the link and the unit of its mesh",
        )
        return
    center = np.array(inertial.origin.pos)
    shapes = [points for each in (link.collisions, link.visuals) if len(points := shapes_points(each))]
    if all(_is_outside(center, points) for points in shapes):  # a collision shape may cover only a part of the link
        yield warning(
            "far-center",
            f"link '{link.name}'",
            f"the link's center of mass ({', '.join(f'{x:.3g}' for x in center)}) is far outside its shape",
            "specify the <origin> of <inertial> in the link's frame, in meters",
        )
        return
    squares = size**2
    most = inertial.mass * (squares.sum() - squares) / 4.0  # (3,) about x, y, z
    moments = np.diag(inertia_matrix(inertial))
    for i, j in permutations(range(3), 2):
        if most[i] > _TURNED * most[j] and moments[j] > _TURNED * moments[i]:
            long, wrong = _AXES[int(np.argmax(size))], _AXES[int(np.argmin(moments))]
            yield warning(
                "turned-inertia",
                f"link '{link.name}'",
                f"the link's shape is longest along {long}, but its inertia suggests that it is longest along {wrong}: "
                f"{_MOMENTS[j]} is {moments[j]:.3g} kg·m² and {_MOMENTS[i]} is {moments[i]:.3g} kg·m²",
                "rotate the inertia to match the shape, for example with the <origin rpy> of <inertial>",
            )
            return
    ratios = moments / most
    worst = int(np.argmax(ratios) if ratios.max() > _MOST else np.argmin(ratios))
    if ratios.max() > _MOST or ratios.max() < _LEAST:
        name, solid = _MOMENTS[worst], most / 3.0
        ratio = float(moments[worst] / solid[worst])
        times = f"{ratio:,.0f}" if ratio >= 10.0 else f"{ratio:.2g}"
        yield warning(
            "absurd-inertia",
            f"link '{link.name}'",
            f"{name} is {moments[worst]:.3g} kg·m², which is {times} times that of a solid box with the link's mass "
            f"and size ({edges} m)",
            f"check the inertia; a solid box has ixx={solid[0]:.3g} iyy={solid[1]:.3g} izz={solid[2]:.3g}",
        )
