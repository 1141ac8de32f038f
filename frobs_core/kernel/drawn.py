"""Shapes of an environment to draw, in moving frames. Viewers use it with every simulator.

The shapes come from the models of the robots and the bodies of the scene, and the poses from their handles, so that no
engine has to support rendering. Sizes and colors that a randomization changes are not included.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from frobs_core.models.model import Geometry, Pose, RobotModel
from frobs_core.util.arrays import Floats

Rgba = tuple[float, float, float, float]

GRAY: Rgba = (0.7, 0.7, 0.72, 1.0)
"""Color of shapes without a color."""


@dataclass(frozen=True)
class DrawnPart:
    """A shape that moves with a frame.

    Attributes:
        name: Name, unique in the environment.
        frame: ``"robot/link"``, or the name of a scene body.
        geometry: Primitive shape or mesh file.
        pose: Pose in the frame.
        rgba: Color, each component in [0, 1], or None if neither the model nor the scene defines one. The colors of a
            mesh file take precedence.
        only_collides: Whether the shape exists only for collisions. Viewers draw such shapes only on demand.
    """

    name: str
    frame: str
    geometry: Geometry
    pose: Pose = field(default_factory=Pose)
    rgba: Rgba | None = None
    only_collides: bool = False


def drawn_parts(env: Any) -> tuple[DrawnPart, ...]:
    """Return everything that is drawn of an environment, except the floor and the markers of its task.

    Args:
        env: A ``RobotEnv`` or ``RobotVectorEnv``, without wrappers.
    """
    robots = (drawn_robot(name, robot.model) for name, robot in env.simulation.robots.items())
    return (*(part for parts in robots for part in parts), *_bodies(env.scene.bodies.items()))


def drawn_robot(name: str, model: RobotModel) -> Iterator[DrawnPart]:
    """Yield everything that is drawn of a robot. A link without visual shapes shows its collision shapes.

    Args:
        name: Name of the robot, with which the names of its frames begin.
        model: Model of the robot.
    """
    for link in model.links:
        frame = f"{name}/{link.name}"
        for i, visual in enumerate(link.visuals):
            yield DrawnPart(f"{frame}/visual{i}", frame, visual.geometry, visual.origin, visual.rgba)
        for i, shape in enumerate(link.collisions):
            yield DrawnPart(f"{frame}/collision{i}", frame, shape.geometry, shape.origin, None, bool(link.visuals))


def _bodies(bodies: Iterable[tuple[str, Any]]) -> Iterator[DrawnPart]:
    for name, body in bodies:
        for i, shape in enumerate(body.parts):
            yield DrawnPart(f"{name}/shape{i}", name, shape.geometry, shape.pose, shape.rgba)


def frame_names(env: Any) -> tuple[str, ...]:
    """Return the names of all frames: ``"robot/link"`` for all links of all robots, and the bodies of the scene."""
    links = (f"{name}/{link.name}" for name, robot in env.simulation.robots.items() for link in robot.model.links)
    return (*links, *env.scene.bodies)


def frame_poses(env: Any, row: int = 0) -> tuple[Floats, Floats]:
    """Return the poses of all frames of one environment in the world frame, in the order of :func:`frame_names`.

    Args:
        env: A ``RobotEnv`` or ``RobotVectorEnv``, without wrappers.
        row: Index of the environment.

    Returns:
        pos (k, 3) [m] and quat_wxyz (k, 4), as new arrays.
    """
    poses = [tuple(each[row] for each in robot.link_poses()) for robot in env.simulation.robots.values()]
    for name in env.scene.bodies:
        pos, quat = env.simulation.bodies[name].pose
        poses.append((pos[row : row + 1], quat[row : row + 1]))
    empty = np.empty((0, 3)), np.empty((0, 4))
    return np.concatenate([empty[0], *(pos for pos, _ in poses)]), np.concatenate([empty[1], *(q for _, q in poses)])
