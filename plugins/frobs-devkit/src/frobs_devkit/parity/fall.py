"""The bodies of a task fall on its floor and come to rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_devkit.parity.free_bodies import Bounded, bodies_of, not_applicable
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, judge, skip
from frobs_devkit.parity.settling import DURATION, Fall, settle, watch_fall
from frobs_devkit.parity.subject import Subject

_QUANTITIES = {"bounce_height": "bounce height", "rest_time": "time to rest", "rest_height": "rest height"}
_SUMMARY = (
    "Each free body of the task's scene falls flat from its own height onto the floor of the task. The rest height is that of "
    "its lowest point; a negative one is the penetration at rest."
)


def fall(subjects: Sequence[Subject]) -> Measurement:
    """Compare how the free bodies of the task bounce and come to rest."""
    reference, bodies = subjects[0], bodies_of(subjects[0])
    if not bodies:
        return not_applicable(subjects, _SUMMARY, "the task has no free body")
    comparisons: list[Comparison] = []
    panels = []
    for body in bodies:
        falls = [_fall(subject, body) for subject in subjects]
        first, *others = [{**settle(*each), "bounce_height": _bounce(each[1])} for each in falls]
        for subject, found in zip(subjects[1:], others, strict=True):
            for name, words in _QUANTITIES.items():
                quantity = f"{words} of '{body.name}'"
                if np.isnan(first[name]):
                    reason = f"it does not rest within {DURATION:g} s on {reference.label}"
                    comparisons.append(skip(subject.label, reference.label, reason, quantity))
                    continue
                factor, unit = (1.0, "s") if name == "rest_time" else (1e3, "mm")
                comparisons.append(
                    judge(
                        name, quantity, subject.label, reference.label, abs(found[name] - first[name]), exact=False,
                        scale=body.edges[0],
                        where=f"{factor * found[name]:.3g} instead of {factor * first[name]:.3g} {unit}",
                    )
                )  # fmt: skip
        lines = tuple(
            Line(s.label, times, 1e3 * lowest, i, i)
            for i, (s, (times, lowest, _)) in enumerate(zip(subjects, falls, strict=True))
        )
        panels.append(Panel(title=f"Lowest point of '{body.name}'", x_label="s", y_label="mm", lines=lines))
    return Measurement(summary=_SUMMARY, comparisons=tuple(comparisons), panels=tuple(panels))


def _fall(subject: Subject, body: Bounded) -> Fall:
    with subject.make() as env:
        env.reset(seed=0)
        body.put_on_floor(env, height=body.edges[0])
        handle, timestep = env.simulation.bodies[body.name], env.simulation.physics_timestep
        return watch_fall(env.simulation, handle, body.points, body.edges[2], timestep)


def _bounce(lowest: Floats) -> float:
    """Return the largest height of the lowest point after it first turned upward, ≥ 0 [m]; 0: it never did."""
    rising = np.flatnonzero(np.diff(lowest) > 0.0)
    return float(max(0.0, lowest[rising[0] :].max())) if len(rising) else 0.0
