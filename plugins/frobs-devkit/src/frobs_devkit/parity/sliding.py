"""Compares how far the free bodies of a task slide on the floor until friction stops them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_devkit.parity.free_bodies import Bounded, compare_bodies, compare_values, draw_curves
from frobs_devkit.parity.result import Comparison, Measurement, Panel
from frobs_devkit.parity.under_test import Subject

_SPEED = 1.0  # [m/s]
_STOPPED = 0.02  # [m/s]
_REST = 0.2  # [s] time on the floor before the body starts to slide
_DURATION = 4.0  # [s]
_SUMMARY = (
    f"Each free body of the task's scene lies on the task's floor and starts to slide at {_SPEED:g} m/s. The sliding "
    "distance depends on the friction coefficients of the body and the floor, and on how the engine combines them."
)


def sliding(subjects: Sequence[Subject]) -> Measurement:
    """Compare how far the task's free bodies slide."""

    def compare(body: Bounded) -> tuple[list[Comparison], Panel]:
        slides = [_slide(subject, body) for subject in subjects]
        distances = [distance for _, _, distance in slides]
        comparisons = compare_values(
            subjects,
            "sliding_distance",
            f"sliding distance of '{body.name}'",
            distances,
            scale=distances[0],
            unknown=f"the body does not stop within {_DURATION:g} s",
            unit="m",
        )
        curves = ((times, ways) for times, ways, _ in slides)
        return comparisons, draw_curves(subjects, f"Distance of '{body.name}'", "s", "m", curves)

    return compare_bodies(subjects, _SUMMARY, compare)


def _slide(subject: Subject, body: Bounded) -> tuple[Floats, Floats, float]:
    """Return the times (samples,) [s], the distances (samples,) [m] and the stopping distance [m] of a sliding body.

    The stopping distance is NaN if the body does not stop.
    """
    with subject.make() as env:
        env.reset(seed=0)
        simulation, handle = env.simulation, env.simulation.bodies[body.name]
        timestep = simulation.physics_timestep
        body.put_on_floor(env)
        simulation.step(round(_REST / timestep))
        handle.write_twist(np.array([[_SPEED, 0.0, 0.0]]), np.zeros((1, 3)))
        start = handle.pose[0][0].copy()
        ways = np.empty(round(_DURATION / timestep))
        for k in range(len(ways)):
            simulation.step(1)
            ways[k] = np.linalg.norm((handle.pose[0][0] - start)[:2])
        stopped = float(np.linalg.norm(handle.twist[0][0])) < _STOPPED
    times = timestep * np.arange(1.0, len(ways) + 1.0)
    return times, ways, float(ways[-1]) if stopped else float("nan")
