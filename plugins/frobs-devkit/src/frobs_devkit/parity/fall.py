"""Compares how the free bodies of a task fall onto the floor and come to rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_devkit.parity.free_bodies import Bounded, compare_bodies, compare_values, draw_curves
from frobs_devkit.parity.result import Comparison, Measurement, Panel
from frobs_devkit.parity.settling import DURATION, Fall, settle, watch_fall
from frobs_devkit.parity.under_test import Subject

_QUANTITIES = {"bounce_height": "bounce height", "rest_time": "time to rest", "rest_height": "rest height"}
_SUMMARY = (
    "Each free body of the task's scene falls flat onto the task's floor from a height equal to its own height. The "
    "rest height is the height of the body's lowest point at rest. A negative value means that the body penetrates the "
    "floor."
)


def fall(subjects: Sequence[Subject]) -> Measurement:
    """Compare how the task's free bodies bounce and come to rest."""

    def compare(body: Bounded) -> tuple[list[Comparison], Panel]:
        falls = [_fall(subject, body) for subject in subjects]
        bounces = [{**settle(*each), "bounce_height": _bounce(each[1])} for each in falls]
        comparisons: list[Comparison] = []
        for name, words in _QUANTITIES.items():
            factor, unit = (1.0, "s") if name == "rest_time" else (1e3, "mm")
            comparisons += compare_values(
                subjects,
                name,
                f"{words} of '{body.name}'",
                [each[name] for each in bounces],
                scale=body.edges[0],
                unknown=f"the body does not rest within {DURATION:g} s",
                factor=factor,
                unit=unit,
            )
        curves = ((times, 1e3 * lowest) for times, lowest, _ in falls)
        return comparisons, draw_curves(subjects, f"Lowest point of '{body.name}'", "s", "mm", curves)

    return compare_bodies(subjects, _SUMMARY, compare)


def _fall(subject: Subject, body: Bounded) -> Fall:
    with subject.make() as env:
        env.reset(seed=0)
        body.put_on_floor(env, height=body.edges[0])
        handle, timestep = env.simulation.bodies[body.name], env.simulation.physics_timestep
        return watch_fall(env.simulation, handle, body.points, body.edges[2], timestep)


def _bounce(lowest: Floats) -> float:
    """Return the largest height of a body's lowest point after its first upward motion [m], or 0 if it never bounces."""
    rising = np.flatnonzero(np.diff(lowest) > 0.0)
    return float(max(0.0, lowest[rising[0] :].max())) if len(rising) else 0.0
