"""Adds shapes to a MuJoCo model as geoms, and defines the geom groups for rendering and rays."""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
import numpy.typing as npt

from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Pose, Sphere
from frobs_core.util.errors import ConfigurationError
from frobs_sim_mujoco.meshes import Meshes

SCENE_GROUP = 0
"""Geom group of the scene's collision shapes, which are rendered and hit by rays."""
VISUAL_GROUP = 1
"""Geom group of visual shapes."""
ROBOT_GROUPS = (2, 3, 4, 5)
"""Geom groups of the robots' collision shapes. A robot's lidars do not detect shapes in the robot's own group."""

_HARD_CONTACT = (0.98, 0.995, 0.001, 0.5, 2.0)
"""Impedance (``solimp``) of hard contacts.

Their time constant is two timesteps. With MuJoCo's default time constant of 20 ms, pads that press with 70 N would sink
10 mm into a 0.1 kg object, and an arm could press this object 20 mm into the floor.
"""

_DOMINANT = 1000.0
"""Weight (``solmix``) of a hard shape's parameters in contacts with other shapes, whose weight is 1."""


@cache
def seen_except(group: int | None = None) -> npt.NDArray[np.uint8]:
    """Return a mask of the geom groups that rays hit, (mjNGROUP,): all colliding groups except ``group``."""
    seen = np.zeros(int(mujoco.mjNGROUP), np.uint8)
    seen[[other for other in (SCENE_GROUP, *ROBOT_GROUPS) if other != group]] = 1
    return seen


def add_shape(
    meshes: Meshes,
    element: mujoco.MjsBody,
    geometry: Geometry,
    origin: Pose,
    group: int,
    rgba: tuple[float, float, float, float] | None,
    *,
    collides: bool,
) -> list[mujoco.MjsGeom]:
    """Add a shape as one geom, or a mesh as one geom per convex piece (if colliding) or per color (if visual)."""
    if isinstance(geometry, Mesh):
        geoms = []
        for name, own_rgba in meshes.hull(geometry) if collides else meshes.drawn(geometry):
            geom = _add_plain_geom(element, origin, group, own_rgba or rgba, collides=collides)
            geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, name
            geoms.append(geom)
        return geoms
    geom = _add_plain_geom(element, origin, group, rgba, collides=collides)
    match geometry:
        case Box(size):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_BOX, [edge / 2 for edge in size]
        case Sphere(radius):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_SPHERE, [radius, 0, 0]
        case Cylinder(radius, length):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_CYLINDER, [radius, length / 2, 0]
        case Capsule(radius, length):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_CAPSULE, [radius, length / 2, 0]
    return [geom]


def _add_plain_geom(
    element: mujoco.MjsBody, origin: Pose, group: int, rgba: tuple[float, float, float, float] | None, *, collides: bool
) -> mujoco.MjsGeom:
    """Add a geom and set all of its fields except the shape."""
    geom = element.add_geom(pos=origin.pos, quat=origin.quat_wxyz, group=group)
    geom.contype = geom.conaffinity = int(collides)
    geom.rgba = rgba or (0.7, 0.7, 0.72, 1.0)
    if not collides:
        geom.mass = 0.0
    return geom


def set_friction(spec: mujoco.MjSpec, body: str, friction: float) -> None:
    """Set the sliding friction of a body's shapes, regardless of the other body's friction.

    By default, MuJoCo uses the larger of two bodies' friction coefficients, so this function raises the priority of the
    body's shapes. If ``friction`` is 0, the contact dimension is set to 1, because MuJoCo only omits friction in
    one-dimensional contacts. If ``friction`` is positive, the contacts are hard.

    Raises:
        ConfigurationError: The body does not exist.
    """
    element = spec.body(body)
    if element is None:
        raise ConfigurationError(f"the robot's 'friction' has an entry for '{body}', which is not a link.")
    for geom in element.geoms:
        geom.priority = 1
        if friction > 0.0:
            geom.friction[0] = friction
            make_hard(spec, geom)
        else:
            geom.condim = 1


def make_hard(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> None:
    """Make the contacts of a shape as hard as the timestep allows, regardless of the other shape."""
    geom.solref, geom.solimp, geom.solmix = (2.0 * spec.option.timestep, 1.0), _HARD_CONTACT, _DOMINANT
