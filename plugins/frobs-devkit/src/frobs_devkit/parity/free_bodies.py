"""Places the free bodies of a task's scene, and compares their behavior."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from frobs_core.description import AT_REST, Body
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import Pose
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_from_matrix, quat_rotate
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, judge, skip
from frobs_devkit.parity.under_test import Subject
from frobs_models import shape_points

AWAY = 5.0
"""Distance between the robot and a body on the floor [m], which exceeds the robot's reach."""


class Bounded:
    """A free body of a task's scene, with its bounding box.

    Args:
        name: Name of the body in the scene.
        body: Description of the body.

    Attributes:
        name: Name of the body in the scene.
        points: Points on the body's surface, in the body's frame, (k, 3) [m].
        edges: Edge lengths of the bounding box in ascending order, (3,) [m].
        mass: Mass of the body [kg].
    """

    def __init__(self, name: str, body: Body) -> None:
        assert body.inertial is not None  # every free body has inertial properties
        self.name = name
        self.mass = body.inertial.mass
        self.points = np.concatenate([shape_points(shape) for shape in body.collisions])
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        self._center, size = (low + high) / 2.0, high - low
        self._order = np.argsort(size, kind="stable")
        self.edges = size[self._order]

    def turned(self, shortest: Literal["y", "z"]) -> Floats:
        """Return the quaternion (4,) that aligns the longest edge with the x axis.

        Args:
            shortest: Axis that is aligned with the shortest edge.
        """
        matrix = np.zeros((3, 3))
        rows = (1, 2, 0) if shortest == "y" else (2, 1, 0)  # rows for the shortest, middle and longest edges
        matrix[rows, self._order] = 1.0
        matrix[0] *= np.linalg.det(matrix)  # avoids a mirror image
        return np.asarray(quat_from_matrix(matrix))

    def origin(self, center: Floats, quat_wxyz: Floats) -> Floats:
        """Return the position (3,) [m] of the body's frame at which the bounding box is centered at ``center``."""
        return np.asarray(center - quat_rotate(quat_wxyz, self._center))

    def put_on_floor(self, env: RobotEnv, height: float = 0.0) -> None:
        """Place the body flat on the floor, far from the robot.

        Args:
            env: The environment.
            height: Height of the body's lowest point above the floor [m].
        """
        x, y, _ = env.robot.base_pose[0][0]
        quat = self.turned("z")
        center = np.array([x + AWAY, y, height + self.edges[0] / 2.0])
        env.simulation.bodies[self.name].write_pose(self.origin(center, quat)[None], quat[None])


def bodies_of(subject: Subject) -> list[Bounded]:
    """Return the task's free bodies with collision shapes, but only one of several bodies with the same properties."""
    distinct: dict[str, Body] = {}
    for name, body in subject.free_bodies.items():
        alike = replace(body, pose=Pose(), twist=AT_REST, rgba=(0.0, 0.0, 0.0, 1.0))
        if body.collisions and alike not in distinct.values():
            distinct[name] = alike
    return [Bounded(name, body) for name, body in distinct.items()]


def compare_bodies(
    subjects: Sequence[Subject], summary: str, compare: Callable[[Bounded], tuple[list[Comparison], Panel]]
) -> Measurement:
    """Call ``compare`` for each free body of the task, and return all results as one measurement."""
    bodies = bodies_of(subjects[0])
    if not bodies:
        return not_applicable(subjects, summary, "the task has no free body")
    results = [compare(body) for body in bodies]
    comparisons = tuple(comparison for each, _ in results for comparison in each)
    return Measurement(summary=summary, comparisons=comparisons, panels=tuple(panel for _, panel in results))


def compare_values(
    subjects: Sequence[Subject],
    name: str,
    quantity: str,
    values: Sequence[float],
    *,
    scale: float,
    unknown: str,
    unit: str,
    factor: float = 1.0,
    missing: str = "none",
) -> list[Comparison]:
    """Compare the value of each simulator with the value of the first simulator.

    Args:
        subjects: The simulators.
        name: Name of the tolerance.
        quantity: Name of the value.
        values: Value of each simulator, or NaN for a simulator without a value.
        scale: Factor that scales a relative tolerance.
        unknown: Reason for skipping the comparisons if the first simulator has no value.
        unit: Unit in which the values are displayed.
        factor: Factor that converts the values to ``unit``.
        missing: Text that is displayed instead of NaN.
    """

    def show(value: float) -> str:
        return missing if np.isnan(value) else f"{factor * value:.3g}"

    reference, *others = subjects
    if np.isnan(values[0]):
        return [skip(each.label, reference.label, f"{unknown} on {reference.label}", quantity) for each in others]
    return [
        judge(
            name,
            quantity,
            each.label,
            reference.label,
            abs(value - values[0]),
            exact=False,
            scale=scale,
            where=f"{show(value)} instead of {show(values[0])} {unit}",
        )
        for each, value in zip(others, values[1:], strict=True)
    ]


def draw_curves(
    subjects: Sequence[Subject], title: str, x_label: str, y_label: str, curves: Iterable[tuple[Floats, Floats]]
) -> Panel:
    """Return a panel with one curve for each simulator. Simulators without points are omitted."""
    lines = tuple(
        Line(subject.label, x, y, i, i)
        for i, (subject, (x, y)) in enumerate(zip(subjects, curves, strict=True))
        if len(x)
    )
    return Panel(title=title, x_label=x_label, y_label=y_label, lines=lines)


def not_applicable(subjects: Sequence[Subject], summary: str, reason: str) -> Measurement:
    """Return a measurement that is skipped on all simulators for the given reason."""
    reference, *others = subjects
    comparisons: tuple[Comparison, ...] = tuple(skip(s.label, reference.label, reason) for s in others)
    return Measurement(summary=summary, comparisons=comparisons)
