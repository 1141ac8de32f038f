"""Compares how a box falls onto the floor and comes to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from frobs_core.contracts import BodyHandle, Simulation
from frobs_core.description import Body
from frobs_core.models import Box, Pose
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_rotate
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, judge
from frobs_devkit.parity.under_test import Subject

EDGE = 0.1
"""Edge length of the box [m]."""

DURATION = 2.0
"""Recorded duration of a fall [s]."""

Fall: TypeAlias = tuple[Floats, Floats, Floats]
"""Times [s], heights of the lowest point above the floor [m], and speeds [m/s], each of shape (samples,)."""

_MASS = 0.5  # [kg]
_CLEARANCE = 0.1  # [m] initial height above the floor
_AWAY = 5.0  # [m] distance from the robot, larger than the robot's reach
_STILL = 0.01  # [m/s] speed below which the box is considered at rest
_QUANTITIES = {"rest_height": "rest height", "rest_time": "time to rest", "penetration": "deepest penetration"}
_END = 0.2  # [s] interval at the end over which the rest height is averaged


def settling(subjects: Sequence[Subject]) -> Measurement:
    """Compare the rest height, the time to rest and the penetration of a box that falls flat onto the floor."""
    reference = subjects[0]
    drops = [_drop(subject, reference.physics_timestep) for subject in subjects]
    numbers = [settle(*drop) for drop in drops]
    comparisons: list[Comparison] = []
    for subject, other in zip(subjects[1:], numbers[1:], strict=True):
        for name, quantity in _QUANTITIES.items():
            a, b = numbers[0][name], other[name]
            scale, unit = (1.0, "s") if name == "rest_time" else (1e3, "mm")
            comparisons.append(
                judge(
                    name, quantity, subject.label, reference.label, abs(a - b), exact=False,
                    where=f"{scale * b:.3g} instead of {scale * a:.3g} {unit}",
                )
            )  # fmt: skip
    lines = tuple(
        Line(subject.label, times, 1e3 * lowest, i, i)
        for i, (subject, (times, lowest, _)) in enumerate(zip(subjects, drops, strict=True))
    )
    near = tuple(_near_the_floor(line) for line in lines)
    return Measurement(
        summary=f"A cube with a mass of {_MASS} kg and an edge length of {100 * EDGE:.0f} cm falls "
        f"{100 * _CLEARANCE:.0f} cm and lands flat on the floor. Contact models differ between engines, so a task can "
        "only rely on agreement within the tolerances.",
        comparisons=tuple(comparisons),
        panels=(
            Panel(title="Lowest corner", x_label="s", y_label="mm above the floor", lines=lines),
            Panel(title="Detail near the floor", x_label="s", y_label="mm above the floor", lines=near),
        ),
    )


def _near_the_floor(line: Line) -> Line:
    """Return the part of a curve around the impact, where the height is below a tenth of the initial height."""
    near = (line.x > 0.1) & (line.x < 0.6)
    return replace(line, x=line.x[near], y=np.where(line.y[near] < 100.0 * _CLEARANCE, line.y[near], np.nan))


def _drop(subject: Subject, period: float) -> Fall:
    x, y, _ = subject.placement.pose.pos
    start = Pose(pos=(x + _AWAY, y, EDGE / 2.0 + _CLEARANCE))
    bodies = {"box": Body(geometry=Box((EDGE, EDGE, EDGE)), pose=start, mass=_MASS)}
    corners = 0.5 * EDGE * np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])  # (8, 3)
    with subject.simulate(subject.alone(), bodies, floor=True) as (simulation, _):
        return watch_fall(simulation, simulation.bodies["box"], corners, EDGE, period)


def watch_fall(simulation: Simulation, body: BodyHandle, points: Floats, length: float, period: float) -> Fall:
    """Step the simulation for :data:`DURATION`, and record the motion of a body.

    Args:
        simulation: Simulation of a single environment.
        body: The body that falls.
        points: Points of the body in the body's frame, (k, 3) [m]. The height of the lowest point is recorded.
        length: Length of the body [m]. The recorded speed is the linear speed plus ``length`` times the angular speed.
        period: Time between two samples [s].
    """
    steps, samples = max(1, round(period / simulation.physics_timestep)), round(DURATION / period)
    lowest, speed = np.empty(samples), np.empty(samples)
    for k in range(samples):
        simulation.step(steps)
        pos, quat = body.pose
        lowest[k] = (pos[0] + quat_rotate(quat[0], points))[:, 2].min()
        linear, angular = body.twist
        speed[k] = np.sqrt((linear[0] ** 2).sum()) + length * np.sqrt((angular[0] ** 2).sum())
    return period * np.arange(1.0, samples + 1.0), lowest, speed


def settle(times: Floats, lowest: Floats, speed: Floats) -> dict[str, float]:
    """Return ``rest_height`` [m], ``rest_time`` [s] and ``penetration`` [m] of a fall.

    ``rest_time`` is NaN if the body does not come to rest.
    """
    moving = np.flatnonzero(~(speed < _STILL))  # NaN is considered moving
    rests = len(moving) == 0 or moving[-1] + 1 < len(times)
    return {
        "rest_height": float(lowest[times > DURATION - _END].mean()),
        "rest_time": float(times[moving[-1]] if len(moving) else 0.0) if rests else float("nan"),
        "penetration": float(max(0.0, -lowest.min())),
    }
