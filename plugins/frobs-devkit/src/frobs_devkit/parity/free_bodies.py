"""Where the measurements of a task's own bodies place them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.env import RobotEnv
from frobs_core.interfaces import AT_REST, Body
from frobs_core.models import Pose, shape_points
from frobs_core.rotations import quat_from_matrix, quat_rotate
from frobs_devkit.parity.result import Comparison, Measurement, skip
from frobs_devkit.parity.subject import Subject

AWAY = 5.0
"""[m] between the robot and a body on the floor: out of its reach."""


class Bounded:
    """A free body of a task's scene, with its bounding box.

    Args:
        name: Name of the body in the scene.
        body: Its description.

    Attributes:
        name: Name of the body in the scene.
        points: (k, 3) [m] points of its surface in its frame.
        edges: (3,) [m] edges of its bounding box, the shortest first.
        mass: Its mass [kg].
    """

    def __init__(self, name: str, body: Body) -> None:
        assert body.inertial is not None  # it is free
        self.name = name
        self.mass = body.inertial.mass
        self.points = np.concatenate([shape_points(shape) for shape in body.collisions])
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        self._center, size = (low + high) / 2.0, high - low
        self._order = np.argsort(size, kind="stable")
        self.edges = size[self._order]

    def turned(self, shortest: Literal["y", "z"]) -> Floats:
        """Return the orientation in which the longest edge is along the x axis, (4,).

        Args:
            shortest: The axis along which the shortest edge is.
        """
        matrix = np.zeros((3, 3))
        rows = (1, 2, 0) if shortest == "y" else (2, 1, 0)  # of the shortest, the middle and the longest edge
        matrix[rows, self._order] = 1.0
        matrix[0] *= np.linalg.det(matrix)  # no mirror image
        return np.asarray(quat_from_matrix(matrix))

    def origin(self, center: Floats, quat_wxyz: Floats) -> Floats:
        """Return where its frame is when the middle of its bounding box is at a place, (3,) [m]."""
        return np.asarray(center - quat_rotate(quat_wxyz, self._center))

    def put_on_floor(self, env: RobotEnv, height: float = 0.0) -> None:
        """Place the body flat, far from the robot.

        Args:
            env: The environment.
            height: Of its lowest point above the floor [m].
        """
        x, y, _ = env.robot.base_pose[0][0]
        quat = self.turned("z")
        center = np.array([x + AWAY, y, height + self.edges[0] / 2.0])
        env.simulation.bodies[self.name].write_pose(self.origin(center, quat)[None], quat[None])


def bodies_of(subject: Subject) -> list[Bounded]:
    """Return the free bodies of a task's scene that can touch something; of equal ones only the first."""
    found: dict[str, Body] = {}
    for name, body in subject.free_bodies.items():
        alike = replace(body, pose=Pose(), twist=AT_REST, rgba=(0.0, 0.0, 0.0, 1.0))
        if body.collisions and alike not in found.values():
            found[name] = alike
    return [Bounded(name, body) for name, body in found.items()]


def not_applicable(subjects: Sequence[Subject], summary: str, reason: str) -> Measurement:
    """Return a measurement that is skipped on every simulator, with the reason."""
    reference, *others = subjects
    comparisons: tuple[Comparison, ...] = tuple(skip(s.label, reference.label, reason) for s in others)
    return Measurement(summary=summary, comparisons=comparisons)
