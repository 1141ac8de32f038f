"""Compares planar lidar scans of a scene, before and after a body in the scene is moved."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from frobs_core.description import Body, Lidar
from frobs_core.models import Box, Capsule, Cylinder, Pose, Sphere
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, error_panel
from frobs_devkit.parity.tolerances import TOLERANCES
from frobs_devkit.parity.under_test import Subject, pairs_of

_HEIGHT = 0.3  # [m] height of the rays above the robot's root link
_RAYS = 180
_RANGE = 4.0  # [m]
_OWN = "parity"  # name of the lidar that is added to a robot without a lidar


def lidar(subjects: Sequence[Subject]) -> Measurement:
    """Compare the ranges that a lidar measures in a scene with bodies of every shape.

    The measurement uses the robot's first lidar. If the robot has no lidar, a lidar is added to its root link.
    """
    reference = subjects[0]
    scans = [_scan(subject) for subject in subjects]
    comparisons: list[Comparison] = []
    for pair, scan in zip(pairs_of(subjects), scans[1:], strict=True):
        exact = _are_exact([reference, pair.other])
        for moment in ("as built", "after a body moved"):
            if moment not in scans[0] or moment not in scan:
                comparisons.append(pair.skip("bodies cannot be moved", f"ranges, {moment}"))
                continue
            a, b = scans[0][moment], scan[moment]
            worst = int(np.argmax(np.nan_to_num(np.abs(a - b), nan=np.inf)))
            where = f"ray {worst + 1} of {len(a)}: {b[worst]:.4f} m instead of {a[worst]:.4f} m"
            comparisons.append(pair.judge("lidar", f"ranges, {moment}", np.abs(a - b), exact=exact, where=where))
    name, scanner = _scanner(reference)
    return Measurement(
        summary=f"The ranges of {scanner.rays} rays of "
        f"{'a scanner on the root link' if name == _OWN else f'the lidar {name!r}'} are compared in a scene with "
        "boxes, a sphere, a cylinder and a capsule, and again after a body is moved.",
        comparisons=tuple(comparisons),
        panels=_panels(subjects, scans, scanner),
    )


def _scanner(subject: Subject) -> tuple[str, Lidar]:
    robot = subject.placement.robot
    if robot.lidars:
        return next(iter(robot.lidars.items()))
    return _OWN, Lidar(
        frame=subject.placement.model.root, rays=_RAYS, range_min=0.05, range_max=_RANGE, offset=(0.0, 0.0, _HEIGHT)
    )


def _bodies(subject: Subject) -> Mapping[str, Body]:
    """Return the bodies to scan: walls on two sides and one body of each shape, all tall enough to be seen by any lidar."""
    x, y, _ = subject.placement.pose.pos

    def at(dx: float, dy: float, yaw: float = 0.0) -> Pose:
        return Pose((x + dx, y + dy, 0.5), (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)))

    return {
        "wall": Body(geometry=Box((0.1, 6.0, 1.0)), pose=at(3.0, 0.0)),
        "slant": Body(geometry=Box((4.0, 0.1, 1.0)), pose=at(-1.0, 2.5, 0.3)),
        "box": Body(geometry=Box((0.5, 0.3, 1.0)), pose=at(1.3, -1.1, 0.7), kinematic=True),
        "cylinder": Body(geometry=Cylinder(0.25, 1.0), pose=at(-1.4, -0.9)),
        "sphere": Body(geometry=Sphere(0.5), pose=at(0.4, 1.6)),
        "capsule": Body(geometry=Capsule(0.2, 1.0), pose=at(-1.5, 0.7)),
    }


def _scan(subject: Subject) -> dict[str, Floats]:
    """Return the measured ranges (rays,) [m] in the initial scene, and after a body was moved."""
    name, scanner = _scanner(subject)
    alone = subject.alone()
    placement = replace(alone, robot=replace(alone.robot, sensors={name: scanner}))
    with subject.simulate(placement, _bodies(subject), floor=True) as (simulation, robot):
        ranges = {"as built": robot.lidar(name)[0].copy()}
        if subject.level("teleport"):
            box = simulation.bodies["box"]
            box.write_pose(box.pose[0] + np.array([[-0.2, 0.45, 0.0]]))
            ranges["after a body moved"] = robot.lidar(name)[0].copy()
    return ranges


def _panels(subjects: Sequence[Subject], scans: Sequence[Mapping[str, Floats]], scanner: Lidar) -> tuple[Panel, ...]:
    angles = scanner.angles
    moment = list(scans[0])[-1]
    points, errors = [], []
    for i, (subject, scan) in enumerate(zip(subjects, scans, strict=True)):
        ranges = scan.get(moment, scan["as built"])
        ranges = np.where(ranges < scanner.range_max, ranges, np.nan)  # rays without a hit are not drawn
        points.append(Line(subject.label, ranges * np.cos(angles), ranges * np.sin(angles), i, i, points=True))
        if i and moment in scan:
            errors.append(Line(subject.label, np.degrees(angles), np.abs(scan[moment] - scans[0][moment]), i))
    allowed = TOLERANCES["lidar"].allowed(_are_exact(subjects))
    return (
        Panel(title=f"Scan, {moment}", x_label="m", y_label="m", lines=tuple(points), map=True),
        error_panel("Difference of each ray", errors, "m", allowed, "degrees"),
    )


def _are_exact(subjects: Sequence[Subject]) -> bool:
    return all(subject.level("rays") == Level.EXACT for subject in subjects)
