"""Compares how bodies fall, spin, roll and slide on the floor until they come to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from frobs_core.contracts import Simulation
from frobs_core.description import Body
from frobs_core.models import Box, Pose, Sphere
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SceneError
from frobs_core.util.rotations import quat_rotate
from frobs_devkit.parity.free_bodies import AWAY, Bounded, Experiment, Outcome, compare_bodies
from frobs_devkit.parity.result import Line, Measurement
from frobs_devkit.parity.tolerances import TOLERANCES
from frobs_devkit.parity.under_test import Subject

_DURATION = 2.0  # [s] of each experiment except the sliding of the task's bodies
_STILL = 0.01  # [m/s] speed below which a body is considered at rest
_END = 0.2  # [s] interval at the end over which the rest height is averaged
_EDGE, _MASS, _CLEARANCE = 0.1, 0.5, 0.1  # [m], [kg], and initial height above the floor [m] of the falling cube
_SPEED, _SLIDING_DURATION, _STOPPED_SPEED = 1.0, 4.0, 0.02  # [m/s], [s] and [m/s] of a sliding body of the task
_SETTLING_TIME = 0.2  # [s] on the floor before the body starts to slide
_HALF, _STOPPED = 0.5, 0.02  # fractions of the initial speed; below the second fraction, a body is considered stopped
_PAIR = 0.5, 0.8  # sliding friction coefficients, chosen so that every combination rule gives a different result
_RULES = {
    "the larger": max(_PAIR),
    "the smaller": min(_PAIR),
    "the product": _PAIR[0] * _PAIR[1],
    "the mean": sum(_PAIR) / 2,
    "the geometric mean": (_PAIR[0] * _PAIR[1]) ** 0.5,
}

_CUBE = Body(geometry=Box((_EDGE,) * 3), pose=Pose((0.0, 0.0, _EDGE / 2.0 + _CLEARANCE)), mass=_MASS)
_PLATE = Body(
    geometry=Box((0.2, 0.2, 0.04)), pose=Pose((0.0, 0.0, 0.02)), mass=0.5, twist=((1.0, 0.0, 0.0), (0.0,) * 3)
)
_BALL = Body(geometry=Sphere(0.05), pose=Pose((0.0, 0.0, 0.05)), mass=0.5)
_SPINNING = replace(_BALL, twist=((0.0, 0.0, 0.0), (0.0, 0.0, 20.0)), torsional_friction=0.005)
_ROLLING = replace(_BALL, twist=((1.0, 0.0, 0.0), (0.0, 20.0, 0.0)), rolling_friction=0.005)
_FRICTIONS = {
    "spin_time": ("time in which a spinning ball loses half its speed", "rad/s", _SPINNING),
    "rolling_distance": ("distance in which a rolling ball loses half its speed", "rad/s", _ROLLING),
    "sliding_distance": ("distance in which a sliding plate loses half its speed", "m/s", _PLATE),
}


@dataclass(frozen=True)
class BodyMotion:
    """Recorded motion of a body."""

    times: Floats  # since the start, (samples,) [s]
    lowest: Floats  # heights of the body's lowest point above the floor, (samples,) [m]
    distances: Floats  # horizontal distances from the start, (samples,) [m]
    linear_speeds: Floats  # (samples,) [m/s]
    angular_speeds: Floats  # (samples,) [rad/s]


def settling(subjects: Sequence[Subject]) -> Measurement:
    """Compare the rest height, the time to rest and the penetration of a box that falls flat onto the floor."""
    experiment = Experiment(
        quantities={
            "rest_height": ("rest height", "mm"),
            "rest_time": ("time to rest", "s"),
            "penetration": ("deepest penetration", "mm"),
        },
        curve="Lowest corner",
        axes=("s", "mm above the floor"),
    )
    motions = [_watch_alone(subject, _CUBE, subjects[0].physics_timestep) for subject in subjects]
    comparisons, lowest = experiment.compare(subjects, [_settle(motion, _EDGE) for motion in motions])
    near = replace(lowest, title="Detail near the floor", lines=tuple(map(_near_the_floor, lowest.lines)))
    return Measurement(
        summary=f"A cube with a mass of {_MASS} kg and an edge length of {100 * _EDGE:.0f} cm falls "
        f"{100 * _CLEARANCE:.0f} cm and lands flat on the floor. Contact models differ between engines, so a task can "
        "only rely on agreement within the tolerances.",
        comparisons=tuple(comparisons),
        panels=(lowest, near),
    )


def friction(subjects: Sequence[Subject]) -> Measurement:
    """Compare how torsional, rolling and sliding friction stop a body, and report each engine's combination rule."""
    facts: dict[str, str] = {}
    results = []
    for name, (text, speed_unit, body) in _FRICTIONS.items():
        experiment = Experiment(quantities={name: (text, "")}, curve=text.capitalize(), axes=("s", speed_unit))
        outcomes: list[Outcome | None] = []
        for subject in subjects:
            try:
                motion = _watch_alone(subject, body, subjects[0].physics_timestep)
            except SceneError:
                outcomes.append(None)
                continue
            speeds = motion.angular_speeds if any(body.twist[1]) else motion.linear_speeds
            covered = motion.times if name == "spin_time" else motion.distances
            outcomes.append(Outcome({name: _slowed(covered, speeds, _HALF)}, motion.times, speeds))
            stop = _slowed(covered, speeds, _STOPPED)
            shown = f"not within {_DURATION:g} s" if np.isnan(stop) else f"{stop:.3g} {TOLERANCES[name].unit}"
            facts[f"{name.replace('_', ' ')} until it stops, {subject.label}"] = shown
        results.append(experiment.compare(subjects, outcomes))
    facts |= {f"sliding friction of {_PAIR[0]:g} on {_PAIR[1]:g}, {s.label}": _combination(s) for s in subjects}
    return Measurement(
        summary="A ball spins, a ball rolls and a plate slides on the floor. All sliding friction coefficients are 1, "
        "so the combined coefficient is 1 on every engine. The rule for combining other coefficients and the time "
        "until each body stops completely are reported, but not compared.",
        comparisons=tuple(comparison for comparisons, _ in results for comparison in comparisons),
        facts=facts,
        panels=tuple(panel for _, panel in results),
    )


def sliding(subjects: Sequence[Subject]) -> Measurement:
    """Compare how far the free bodies of a task slide on the floor until friction stops them."""
    experiment = Experiment(
        quantities={"sliding_distance": ("sliding distance", "m")},
        curve="Distance",
        axes=("s", "m"),
        unknown=f"the body does not stop within {_SLIDING_DURATION:g} s",
    )
    summary = (
        f"Each free body of the task's scene lies on the task's floor and starts to slide at {_SPEED:g} m/s. The sliding "
        "distance depends on the friction coefficients of the body and the floor, and on how the engine combines them."
    )
    return compare_bodies(subjects, summary, experiment, slide)


def fall(subjects: Sequence[Subject]) -> Measurement:
    """Compare how the free bodies of a task fall onto the floor, bounce and come to rest."""
    experiment = Experiment(
        quantities={
            "bounce_height": ("bounce height", "mm"),
            "rest_time": ("time to rest", "s"),
            "rest_height": ("rest height", "mm"),
        },
        curve="Lowest point",
        axes=("s", "mm"),
        relative_to_height=True,
        unknown=f"the body does not rest within {_DURATION:g} s",
    )
    summary = (
        "Each free body of the task's scene falls flat onto the task's floor from a height equal to its own height. The "
        "rest height is the height of the body's lowest point at rest. A negative value means that the body penetrates "
        "the floor."
    )
    return compare_bodies(subjects, summary, experiment, _fall)


def slide(subject: Subject, body: Bounded) -> Outcome:
    """Measure how far a body of the task slides on the task's floor."""
    with subject.make() as env:
        env.reset(seed=0)
        body.put_on_floor(env)
        env.simulation.step(round(_SETTLING_TIME / env.simulation.physics_timestep))
        env.simulation.bodies[body.name].write_twist(np.array([[_SPEED, 0.0, 0.0]]), np.zeros((1, 3)))
        motion = _record(env.simulation, body, _SLIDING_DURATION, env.simulation.physics_timestep)
    distance = float(motion.distances[-1]) if motion.linear_speeds[-1] < _STOPPED_SPEED else float("nan")
    return Outcome({"sliding_distance": distance}, motion.times, motion.distances)


def _fall(subject: Subject, body: Bounded) -> Outcome:
    with subject.make() as env:
        env.reset(seed=0)
        body.put_on_floor(env, height=body.edges[0])
        return _settle(_record(env.simulation, body, _DURATION, env.simulation.physics_timestep), body.edges[2])


def _watch_alone(subject: Subject, body: Body, period: float, floor_friction: float = 1.0) -> BodyMotion:
    """Return the motion of a body in a separate scene, far from the robot."""
    x, y, _ = subject.placement.pose.pos
    bodies = {"body": replace(body, pose=Pose((x + AWAY, y, body.pose.pos[2])))}
    with subject.simulate(subject.alone(), bodies, floor=True, floor_friction=floor_friction) as (simulation, _):
        return _record(simulation, Bounded("body", body), _DURATION, period)


def _record(simulation: Simulation, body: Bounded, duration: float, period: float) -> BodyMotion:
    steps, samples = max(1, round(period / simulation.physics_timestep)), round(duration / period)
    handle = simulation.bodies[body.name]
    start = handle.pose[0][0].copy()
    lowest, distances, linear, angular = np.empty((4, samples))
    for k in range(samples):
        simulation.step(steps)
        pos, quat = handle.pose
        lowest[k] = (pos[0] + quat_rotate(quat[0], body.points))[:, 2].min()
        distances[k] = np.sqrt(((pos[0] - start)[:2] ** 2).sum())
        linear[k], angular[k] = (np.sqrt((velocity[0] ** 2).sum()) for velocity in handle.twist)
    return BodyMotion(period * np.arange(1.0, samples + 1.0), lowest, distances, linear, angular)


def _settle(motion: BodyMotion, length: float) -> Outcome:
    """Return the quantities of a fall, and the curve of the lowest point.

    The speed of a body is its linear speed plus ``length`` [m] times its angular speed. ``rest_time`` is NaN if the body
    does not come to rest. ``bounce_height`` is 0 if the body never moves upward.
    """
    times, lowest = motion.times, motion.lowest
    moving = np.flatnonzero(~(motion.linear_speeds + length * motion.angular_speeds < _STILL))  # NaN is moving
    rests = len(moving) == 0 or moving[-1] + 1 < len(times)
    rising = np.flatnonzero(np.diff(lowest) > 0.0)
    values = {
        "rest_height": float(lowest[times > _DURATION - _END].mean()),
        "rest_time": float(times[moving[-1]] if len(moving) else 0.0) if rests else float("nan"),
        "penetration": float(max(0.0, -lowest.min())),
        "bounce_height": float(max(0.0, lowest[rising[0] :].max())) if len(rising) else 0.0,
    }
    return Outcome(values, times, 1e3 * lowest)


def _near_the_floor(line: Line) -> Line:
    """Return the part of a curve around the impact, where the height is below a tenth of the initial height."""
    near = (line.x > 0.1) & (line.x < 0.6)
    return replace(line, x=line.x[near], y=np.where(line.y[near] < 100.0 * _CLEARANCE, line.y[near], np.nan))


def _slowed(covered: Floats, speeds: Floats, share: float) -> float:
    """Return the time or distance until the speed falls to a fraction of the initial speed, or NaN if it never does."""
    slow = np.flatnonzero(speeds < share * speeds[0])
    return float(covered[slow[0]]) if len(slow) else float("nan")


def _combination(subject: Subject) -> str:
    """Describe the measured friction coefficient between the plate and the floor, and the closest combination rule."""
    plate = replace(_PLATE, friction=_PAIR[0])
    distance = _watch_alone(subject, plate, subject.physics_timestep, floor_friction=_PAIR[1]).distances[-1]
    coefficient = 1.0 / (2.0 * float(np.linalg.norm(subject.gravity)) * distance)  # for an initial speed of 1 m/s
    rule = min(_RULES, key=lambda rule: abs(_RULES[rule] - coefficient))
    return f"{coefficient:.2f}: {rule}, {_RULES[rule]:.2g}"
