"""Compares bodies that spin, roll and slide on the floor until friction stops them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from frobs_core.description import Body
from frobs_core.models import Box, Pose, Sphere
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SceneError
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, judge, skip
from frobs_devkit.parity.under_test import Subject

_AWAY = 5.0  # [m] distance from the robot, larger than the robot's reach
_DURATION = 2.0  # [s]
_HALF, _STOPPED = 0.5, 0.02  # fractions of the initial speed; below the second fraction, a body is considered stopped
_PAIR = 0.5, 0.8  # sliding friction coefficients, chosen so that every combination rule gives a different result
_RULES = {
    "the larger": max(_PAIR),
    "the smaller": min(_PAIR),
    "the product": _PAIR[0] * _PAIR[1],
    "the mean": sum(_PAIR) / 2,
    "the geometric mean": (_PAIR[0] * _PAIR[1]) ** 0.5,
}

_Motion = tuple[Floats, Floats, Floats]  # times [s], speeds, and covered distances [m], (samples,) each

_BALL = Body(geometry=Sphere(0.05), pose=Pose((0.0, 0.0, 0.05)), mass=0.5)
_PLATE = Body(
    geometry=Box((0.2, 0.2, 0.04)), pose=Pose((0.0, 0.0, 0.02)), mass=0.5, twist=((1.0, 0.0, 0.0), (0.0,) * 3)
)
_SPINNING = replace(_BALL, twist=((0.0, 0.0, 0.0), (0.0, 0.0, 20.0)), torsional_friction=0.005)
_ROLLING = replace(_BALL, twist=((1.0, 0.0, 0.0), (0.0, 20.0, 0.0)), rolling_friction=0.005)


def friction(subjects: Sequence[Subject]) -> Measurement:
    """Compare how torsional, rolling and sliding friction stop a body, and report each engine's combination rule."""
    reference = subjects[0]
    cases = {
        "spin_time": ("time in which a spinning ball loses half its speed", "rad/s", _SPINNING),
        "rolling_distance": ("distance in which a rolling ball loses half its speed", "rad/s", _ROLLING),
        "sliding_distance": ("distance in which a sliding plate loses half its speed", "m/s", _PLATE),
    }
    comparisons: list[Comparison] = []
    panels: list[Panel] = []
    facts: dict[str, str] = {}
    for name, (quantity, y_label, body) in cases.items():
        motions = [_move(subject, reference.physics_timestep, body) for subject in subjects]
        numbers = [None if motion is None else _number(name, motion, _HALF) for motion in motions]
        for subject, motion in zip(subjects, motions, strict=True):
            if motion is not None:
                number, unit = _number(name, motion, _STOPPED), "s" if name == "spin_time" else "m"
                text = f"not within {_DURATION:g} s" if np.isnan(number) else f"{number:.3g} {unit}"
                facts[f"{name.replace('_', ' ')} until it stops, {subject.label}"] = text
        for subject, other in zip(subjects[1:], numbers[1:], strict=True):
            if other is None or numbers[0] is None:
                refuses = subject if other is None else reference
                reason = f"{refuses.label} rejects the scene"
                comparisons.append(skip(subject.label, reference.label, reason, quantity))
                continue
            comparisons.append(
                judge(
                    name, quantity, subject.label, reference.label, abs(numbers[0] - other), exact=False,
                    scale=numbers[0], where=f"{other:.3g} instead of {numbers[0]:.3g}",
                )
            )  # fmt: skip
        lines = [Line(s.label, m[0], m[1], i, i) for i, (s, m) in enumerate(zip(subjects, motions, strict=True)) if m]
        panels.append(Panel(title=quantity.capitalize(), x_label="s", y_label=y_label, lines=tuple(lines)))
    facts |= {f"sliding friction of {_PAIR[0]:g} on {_PAIR[1]:g}, {s.label}": _combination(s) for s in subjects}
    return Measurement(
        summary="A ball spins, a ball rolls and a plate slides on the floor. All sliding friction coefficients are 1, "
        "so the combined coefficient is 1 on every engine. The rule for combining other coefficients and the time "
        "until each body stops completely are reported, but not compared.",
        comparisons=tuple(comparisons),
        facts=facts,
        panels=tuple(panels),
    )


def _move(subject: Subject, period: float, body: Body, floor_friction: float = 1.0) -> _Motion | None:
    """Return the motion of a body, or None if the simulator rejects the scene."""
    x, y, _ = subject.placement.pose.pos
    placed = replace(body, pose=Pose((x + _AWAY, y, body.pose.pos[2])))
    steps, samples = max(1, round(period / subject.physics_timestep)), round(_DURATION / period)
    turns = any(body.twist[1])
    speeds, ways = np.empty(samples), np.empty(samples)
    try:
        with subject.simulate(subject.alone(), {"body": placed}, floor=True, floor_friction=floor_friction) as (
            simulation,
            _,
        ):
            handle = simulation.bodies["body"]
            start = handle.pose[0][0].copy()
            for k in range(samples):
                simulation.step(steps)
                speeds[k] = np.sqrt((handle.twist[int(turns)][0] ** 2).sum())
                ways[k] = np.sqrt(((handle.pose[0][0] - start)[:2] ** 2).sum())
    except SceneError:
        return None
    return period * np.arange(1.0, samples + 1.0), speeds, ways


def _number(name: str, motion: _Motion, share: float) -> float:
    """Return the time or distance until the speed falls to a fraction of the initial speed, or NaN if it never does."""
    times, speeds, ways = motion
    slow = np.flatnonzero(speeds < share * speeds[0])
    return float((times if name == "spin_time" else ways)[slow[0]]) if len(slow) else float("nan")


def _combination(subject: Subject) -> str:
    """Describe the measured friction coefficient between the plate and the floor, and the closest combination rule."""
    motion = _move(subject, subject.physics_timestep, replace(_PLATE, friction=_PAIR[0]), _PAIR[1])
    assert motion is not None
    distance = motion[2][-1]  # stopping distance for an initial speed of 1 m/s
    coefficient = 1.0 / (2.0 * float(np.linalg.norm(subject.gravity)) * distance)
    rule = min(_RULES, key=lambda rule: abs(_RULES[rule] - coefficient))
    return f"{coefficient:.2f}: {rule}, {_RULES[rule]:.2g}"
