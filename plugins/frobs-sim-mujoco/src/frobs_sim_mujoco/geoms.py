"""Shapes of robots and scenes as geoms, and the groups that determine their visibility and collisions."""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
import numpy.typing as npt

from frobs_core.errors import ConfigurationError
from frobs_core.models import Box, Capsule, Cylinder, Geometry, Mesh, Pose, Sphere
from frobs_sim_mujoco.meshes import Meshes

SCENE_GROUP = 0
"""Geom group of the scene's collision shapes: rendered, and hit by rays."""
VISUAL_GROUP = 1
"""Geom group of visual shapes."""
ROBOT_GROUPS = (2, 3, 4, 5)
"""Geom groups of each robot's collision shapes: hit by rays, except the robot's own rays."""

PAD_IMPEDANCE = (0.98, 0.995, 0.001, 0.5, 2.0)
"""Contact impedance for links that set their own friction, such as gripper pads, with a time constant of two timesteps.
With MuJoCo's default, a 20 ms spring, pads pressing with 70 N sink 10 mm into a 0.1 kg object.
"""


@cache
def seen_except(group: int | None = None) -> npt.NDArray[np.uint8]:
    """Return the geom groups that a ray hits, (mjNGROUP,): all colliding groups, except one robot's."""
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
    """Add a shape as one geom. A colliding mesh gets one per convex piece, a visual mesh one per color."""
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
    """Add a geom with all settings except its shape."""
    geom = element.add_geom(pos=origin.pos, quat=origin.quat_wxyz, group=group)
    geom.contype = geom.conaffinity = int(collides)
    geom.rgba = rgba or (0.7, 0.7, 0.72, 1.0)
    if not collides:
        geom.mass = 0.0
    return geom


def set_friction(spec: mujoco.MjSpec, body: str, friction: float) -> None:
    """Set the sliding friction of a body's shapes, regardless of the other body's friction.

    MuJoCo uses the larger of two coefficients unless one has priority, and omits friction only if a contact has one
    dimension. Shapes with friction also become as hard as :data:`PAD_IMPEDANCE` and the timestep allow.

    Raises:
        ConfigurationError: The body does not exist.
    """
    element = spec.body(body)
    if element is None:
        raise ConfigurationError(f"a robot's friction contains '{body}', which is not a link.")
    for geom in element.geoms:
        geom.priority = 1
        if friction > 0.0:
            geom.friction[0] = friction
            geom.solref, geom.solimp = (2.0 * spec.option.timestep, 1.0), PAD_IMPEDANCE
        else:
            geom.condim = 1
