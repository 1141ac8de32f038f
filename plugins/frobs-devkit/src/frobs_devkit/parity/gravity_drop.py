"""Compares how a robot falls with its drives off. The fall depends only on masses, inertias, damping and gravity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.util.arrays import Mask
from frobs_devkit.parity.motion import differences, error_line, position_bounds, record, worst_joint
from frobs_devkit.parity.result import Line, Measurement, Panel, error_panel
from frobs_devkit.parity.under_test import Subject, pairs_of, tolerance_line

DURATION = 1.0
"""Maximum duration of the fall [s]. The fall ends earlier if a joint reaches its limit."""

_LEAST_FALL = 1e-3  # [rad or m] smaller motions are not compared


def gravity_drop(subjects: Sequence[Subject]) -> Measurement:
    """Compare the fall from the home position until a joint in the reference simulator reaches its limit."""
    reference, unit = subjects[0], subjects[0].joint_unit
    names, period = reference.placement.model.joint_names, reference.physics_timestep
    off = np.zeros((1, 1, len(names)))
    falls = [record(subject, subject.driven(CommandMode.EFFORT), off, DURATION, period) for subject in subjects]
    first = falls[0][0]
    lower, upper = position_bounds(reference)
    inside: Mask = np.all((first.positions > lower) & (first.positions < upper), axis=1)  # (samples,)
    until = len(inside) if inside.all() else int(np.argmin(inside))
    falls = [[motion.until(until) for motion in fall] for fall in falls]
    first = falls[0][0]
    reached = float(np.abs(first.positions - first.positions[:1]).max()) if until else 0.0
    comparisons, error_lines = [], []
    for i, (pair, fall) in enumerate(zip(pairs_of(subjects), falls[1:], strict=True), 1):
        errors = differences(falls[0], fall)
        error_lines.append(error_line(pair.other.label, errors, first.times, i))
        if reached < _LEAST_FALL:
            comparisons.append(pair.skip("gravity does not move any joint of this robot from the home position"))
            continue
        where = worst_joint(errors, names, first.times)
        judged = pair.judge("gravity_drop", "joint positions", errors, scale=reached, where=where, unit=unit)
        comparisons.append(judged)
    lines = tuple(
        Line(name, fall[0].times, fall[0].positions[:, j], j, i)
        for i, fall in enumerate(falls)
        for j, name in enumerate(names)
    )
    return Measurement(
        summary="The robot falls from the home position with its drives off, its base fixed and collisions disabled. "
        f"The fall ends when a joint reaches its limit, or after {DURATION:g} s.",
        comparisons=tuple(comparisons),
        facts={"compared": f"{until * period:.3f} s, in which a joint moved by {reached:.3g} {unit}"},
        panels=(
            Panel(title="Motion of each joint with its drive off", x_label="s", y_label=unit, lines=lines),
            error_panel("Largest difference of any joint", error_lines, unit, tolerance_line("gravity_drop", subjects)),
        ),
    )
