"""Places the free bodies of a task's scene, and compares their behavior."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from frobs_core.description import AT_REST, Body
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import Pose
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_from_matrix, quat_rotate
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel
from frobs_devkit.parity.under_test import Subject, pairs_of
from frobs_models import shape_points

AWAY = 5.0
"""Distance between the robot and a body on the floor [m], which exceeds the robot's reach."""


class Outcome(NamedTuple):
    """Measurements of one simulator in an experiment."""

    values: Mapping[str, float]  # of each quantity in SI units, or NaN if the simulator has no value
    x: Floats  # horizontal coordinates of the curve, (n,)
    y: Floats  # vertical coordinates of the curve, (n,)


class Bounded:
    """A free body of a task's scene with its mass [kg], surface points in its frame, (k, 3) [m], and bounding box.

    ``edges`` are the edge lengths of the bounding box in ascending order, (3,) [m].
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
        """Return the quaternion (4,) that aligns the longest edge with x, and the shortest edge with y or z."""
        matrix = np.zeros((3, 3))
        rows = (1, 2, 0) if shortest == "y" else (2, 1, 0)  # rows for the shortest, middle and longest edges
        matrix[rows, self._order] = 1.0
        matrix[0] *= np.linalg.det(matrix)  # avoids a mirror image
        return np.asarray(quat_from_matrix(matrix))

    def origin(self, center: Floats, quat_wxyz: Floats) -> Floats:
        """Return the position (3,) [m] of the body's frame at which the bounding box is centered at ``center``."""
        return np.asarray(center - quat_rotate(quat_wxyz, self._center))

    def put_on_floor(self, env: RobotEnv, height: float = 0.0) -> None:
        """Place the body flat, far from the robot, with its lowest point at a height above the floor [m]."""
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


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """An experiment with a body, as it is shown in the certificate."""

    quantities: Mapping[str, tuple[str, str]]  # description and displayed unit, by name of the tolerance
    curve: str  # title of the curves
    axes: tuple[str, str]  # labels of the axes of the curves
    relative_to_height: bool = False  # whether relative tolerances are fractions of the body's height, not of the value
    unknown: str = ""  # why the first simulator has no value, which skips the comparison instead of failing it
    missing: str = "none"  # text that is displayed if another simulator has no value

    def compare(
        self, subjects: Sequence[Subject], outcomes: Sequence[Outcome | None], body: Bounded | None = None
    ) -> tuple[list[Comparison], Panel]:
        """Compare the values of each simulator with the values of the first simulator, and draw the curves.

        The outcome of a simulator is None if it rejects the scene. The descriptions name the body, if there is one.
        """
        of = f" of '{body.name}'" if body else ""
        comparisons, expected = [], outcomes[0]
        for name, (text, unit) in self.quantities.items():
            for pair, outcome in zip(pairs_of(subjects), outcomes[1:], strict=True):
                if expected is None or outcome is None:
                    rejecting = pair.reference if outcome else pair.other
                    comparisons.append(pair.skip(f"{rejecting.label} rejects the scene", text + of))
                    continue
                value, first = outcome.values[name], expected.values[name]
                if self.unknown and np.isnan(first):
                    comparisons.append(pair.skip(f"{self.unknown} on {pair.reference.label}", text + of))
                    continue
                scale = body.edges[0] if body and self.relative_to_height else first
                where = f"{self._show(value, unit)} instead of {self._show(first, unit)} {unit}".rstrip()
                error = abs(value - first)
                comparisons.append(pair.judge(name, text + of, error, exact=False, scale=scale, where=where))
        lines = tuple(
            Line(subject.label, outcome.x, outcome.y, i, i)
            for i, (subject, outcome) in enumerate(zip(subjects, outcomes, strict=True))
            if outcome and len(outcome.x)
        )
        return comparisons, Panel(title=self.curve + of, x_label=self.axes[0], y_label=self.axes[1], lines=lines)

    def _show(self, value: float, unit: str) -> str:
        if self.unknown and np.isnan(value):
            return self.missing
        return f"{1e3 * value if unit == 'mm' else value:.3g}"


def compare_bodies(
    subjects: Sequence[Subject], summary: str, experiment: Experiment, measure: Callable[[Subject, Bounded], Outcome]
) -> Measurement:
    """Repeat an experiment with each free body of the task, and return all results as one measurement."""
    bodies = bodies_of(subjects[0])
    if not bodies:
        return not_applicable(subjects, summary, "the task has no free body")
    results = [experiment.compare(subjects, [measure(each, body) for each in subjects], body) for body in bodies]
    return Measurement(
        summary=summary,
        comparisons=tuple(comparison for comparisons, _ in results for comparison in comparisons),
        panels=tuple(panel for _, panel in results),
    )


def not_applicable(subjects: Sequence[Subject], summary: str, reason: str) -> Measurement:
    """Return a measurement that is skipped on all simulators for the given reason."""
    return Measurement(summary=summary, comparisons=tuple(pair.skip(reason) for pair in pairs_of(subjects)))
