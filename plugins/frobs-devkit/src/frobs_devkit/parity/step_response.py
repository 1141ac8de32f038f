"""Compares the step responses of each joint in free motion, without and with effort limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from frobs_cli.formats import percent
from frobs_core.contracts import CommandMode
from frobs_core.models import composite_inertia
from frobs_core.util.arrays import Floats
from frobs_devkit.parity.motion import (
    Motion,
    apart,
    differences,
    error_line,
    position_bounds,
    record,
    start_positions,
    worst_joint,
)
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, error_panel, worst
from frobs_devkit.parity.under_test import Subject, follows_exactly, pairs_of, tolerance_line

DURATION = 2.0
"""Duration for which each response is compared [s]."""

SATURATED_SHARE = 0.2
"""Minimum fraction of samples at which a joint must be at its effort limit, in the response with effort limits."""

_MOST_SATURATED = 0.8  # maximum fraction of saturated samples, so that each drive is also tested without saturation
# step size [rad or m] and [rad/s or m/s]; smaller near limits
_STEP = {CommandMode.POSITION: 0.2, CommandMode.VELOCITY: 1.0}
_LEAVING = 2  # number of physics steps by which an approximate drive may leave saturation too early or too late
_JUMPS = 4  # number of alternating steps in the response with effort limits
_LONGEST_RISE, _SHORTEST_RISE = 0.3, 0.05  # [s] range of rise times of a joint at its effort limit


def step_response(subjects: Sequence[Subject]) -> Measurement:
    """Compare the step responses without effort limits."""
    reference = subjects[0]
    commands = _jumps(reference)
    unlimited = np.full(len(commands), np.inf)
    motions = [_record(subject, commands, unlimited, reference.physics_timestep) for subject in subjects]
    return Measurement(
        summary="Each joint in turn receives a step command away from the home position, while the commands of the "
        f"other joints stay constant. The motions are compared at every physics step for {DURATION:g} s, without "
        "effort limits or collisions.",
        comparisons=tuple(_judge(subjects, commands, motions)),
        facts={"jumps": _list(reference, np.diag(commands[:, 0]))},
        panels=_panels(subjects, commands, motions, None),
    )


def saturated_step_response(subjects: Sequence[Subject]) -> Measurement:
    """Compare the step responses with effort limits that are low enough to be reached often."""
    reference = subjects[0]
    jumps = _jumps(reference)
    commands = np.concatenate([jumps, np.zeros_like(jumps)] * (_JUMPS // 2), axis=1)  # (dof, phases, dof)
    summary = (
        f"Each joint receives {_JUMPS} alternating step commands. The joint's effort limit is slightly above the "
        "effort that holds it against gravity, so that its drive is saturated in at least "
        f"{100 * SATURATED_SHARE:.0f} % of the {round(DURATION / reference.physics_timestep):,} samples."
    )
    chosen = choose_effort_limits(reference, commands)
    if chosen is None:
        reason = (
            f"no effort limits were found that saturate every drive in at least {100 * SATURATED_SHARE:.0f} % of the "
            "samples and keep every joint within its position limits"
        )
        return Measurement(summary=summary, comparisons=tuple(pair.skip(reason) for pair in pairs_of(subjects)))
    limits, first = chosen
    motions = [first, *(_record(subject, commands, limits, reference.physics_timestep) for subject in subjects[1:])]
    shares = {subject.label: _saturated(motion, limits) for subject, motion in zip(subjects, motions, strict=True)}
    own, facts = None, {}
    if not follows_exactly(*subjects):
        own = _error_of_the_step_size(reference, commands, limits, first)
        facts["effect of the step size"] = (
            f"The reference {reference.label} itself has errors of about {_list(reference, own)} "
            f"{reference.joint_unit}, estimated as twice the change when the step size is halved. Approximate engines "
            "are not required to agree more closely than this. These errors grow while a drive is saturated, because "
            "the drive then cannot correct them"
        )
    return Measurement(
        summary=summary,
        comparisons=tuple(_judge(subjects, commands, motions, own)),
        facts={
            "effort limits": _list(reference, limits),
            **facts,
            **{f"saturated samples, {label}": _percent(reference, share) for label, share in shares.items()},
        },
        panels=_panels(subjects, commands, motions, limits),
    )


def choose_effort_limits(subject: Subject, commands: Floats) -> tuple[Floats, list[Motion]] | None:
    """Return effort limits (dof,) at which each drive saturates often enough, and the resulting responses.

    Each limit is the effort that holds the joint against gravity before and after the step, plus the effort that moves
    the joint's inertia within a rise time. The rise time is shortened for joints that approach a position limit or are
    saturated most of the time. The result is None if no such limits are found.
    """
    model, dof, period = subject.placement.model, len(commands), subject.physics_timestep
    unlimited = np.full(dof, np.inf)
    still = _record(subject, np.zeros((1, 1, dof)), unlimited, period)[0]
    free = _record(subject, commands[:, :1], unlimited, period)
    holding = np.abs(np.stack([motion.efforts[-1] for motion in (still, *free)])).max(axis=0)  # (dof,)
    inertia = np.array(list(composite_inertia(model, start_positions(subject)).values()))
    jump = np.abs(np.diag(commands[:, 0]))
    lower, upper = position_bounds(subject)
    rise = np.full(dof, _LONGEST_RISE)
    while True:
        acceleration = jump / rise if _mode(subject) is CommandMode.VELOCITY else 2.0 * jump / rise**2
        limits = holding + inertia * acceleration
        motions = _record(subject, commands, limits, period)
        shares = _saturated(motions, limits)
        shorten, inside = shares > _MOST_SATURATED, True
        for motion in motions:
            beyond = (motion.positions <= lower) | (motion.positions >= upper)  # (samples, dof)
            if beyond.any():
                inside = False
                # Shorten the rise time of the joint that exceeds its bounds first.
                shorten[beyond[int(beyond.any(axis=1).argmax())].argmax()] = True
        shorten &= rise > _SHORTEST_RISE
        if not shorten.any():
            return (limits, motions) if inside and (shares >= SATURATED_SHARE).all() else None
        rise[shorten] *= 0.93


def _error_of_the_step_size(subject: Subject, commands: Floats, limits: Floats, found: Sequence[Motion]) -> Floats:
    """Return the estimated difference between the subject's motion and the motion with very short physics steps.

    With first-order integration, halving the step size halves the error, which is twice the change in the motion.
    """
    finer = replace(subject, physics_timestep=subject.physics_timestep / 2.0)
    change = differences(found, _record(finer, commands, limits, subject.physics_timestep))
    error: Floats = 2.0 * change.max(axis=(1, 2))
    return error


def _mode(subject: Subject) -> CommandMode:
    """Return the drives' command mode: velocity if no drive has stiffness (usual for wheels), otherwise position."""
    gains = subject.placement.robot.gains
    stiff = gains is None or any(gains.of(name)[0] > 0.0 for name in subject.placement.model.joint_names)
    return CommandMode.POSITION if stiff else CommandMode.VELOCITY


def _jumps(subject: Subject) -> Floats:
    """Return the commands (dof, 1, dof) for one motion per joint, in which only that joint receives a step command.

    A position step is at most a quarter of the way to the joint's farther limit.
    """
    mode, start = _mode(subject), start_positions(subject)
    jumps = np.full(len(start), _STEP[mode])
    if mode is CommandMode.POSITION:
        lower, upper = position_bounds(subject)
        above, below = upper - start, start - lower
        jumps = np.minimum(jumps, np.maximum(above, below) / 4.0) * np.where(above >= below, 1.0, -1.0)
    return np.diag(jumps)[:, None]


def _record(subject: Subject, commands: Floats, limits: Floats, period: float) -> list[Motion]:
    return record(subject, subject.driven(_mode(subject), limits), commands, DURATION, period)


def _saturated(motions: Sequence[Motion], limits: Floats) -> Floats:
    """Return the fraction of samples (dof,) at which each joint was at its effort limit during its own step."""
    return np.array(
        [(np.abs(m.efforts[:, j]) >= (1.0 - 1e-9) * limits[j]).mean() for j, m in enumerate(motions)], np.float64
    )


def _judge(
    subjects: Sequence[Subject], commands: Floats, motions: Sequence[Sequence[Motion]], own: Floats | None = None
) -> Iterator[Comparison]:
    """Yield the worst comparisons of joint positions and of drive efforts for every simulator except the reference."""
    names, unit = subjects[0].placement.model.joint_names, subjects[0].joint_unit
    jumps, least = np.abs(np.diag(commands[:, 0])), np.zeros(len(names)) if own is None else own
    for pair, motion in zip(pairs_of(subjects), motions[1:], strict=True):
        samples = 0 if follows_exactly(pair.reference, pair.other) else _LEAVING
        errors = differences(motions[0], motion)  # (runs, samples, dof)
        positions, efforts = [], []
        for j, (name, jump) in enumerate(zip(names, jumps, strict=True)):
            where = f"jump of {name}; {worst_joint(errors[j], names, motion[j].times)}"
            options: dict[str, Any] = {"scale": float(jump), "least": float(least[j]), "where": where, "unit": unit}
            positions.append(pair.judge("step_response", "joint positions", errors[j], **options))
            expected = motions[0][j].efforts[:, j]
            off = apart(motion[j].efforts[:, j], expected, samples)
            off /= max(float(np.abs(expected).max()), 1e-12)
            where = f"jump of {name}; {worst_joint(off[:, None], [name], motion[j].times)}"
            efforts.append(pair.judge("drive_effort", "drive efforts", off, where=where))
        yield worst(positions)
        yield worst(efforts)


def _panels(
    subjects: Sequence[Subject], commands: Floats, motions: Sequence[Sequence[Motion]], limits: Floats | None
) -> tuple[Panel, ...]:
    names, mode, unit = subjects[0].placement.model.joint_names, _mode(subjects[0]), subjects[0].joint_unit
    moved, effort, off = [], [], []
    for i, (subject, runs) in enumerate(zip(subjects, motions, strict=True)):
        for j, (name, motion) in enumerate(zip(names, runs, strict=True)):
            jump = commands[j, 0, j]
            way = motion.positions[:, j] - start_positions(subject)[j]
            if mode is CommandMode.VELOCITY:
                way = motion.velocities[:, j]
            moved.append(Line(name, motion.times, way / jump, j, i))
            if limits is not None:
                saturated = np.abs(motion.efforts[:, j]) >= (1.0 - 1e-9) * limits[j]
                effort.append(Line(name, motion.times, np.where(saturated, float(j), np.nan), j, i))
        if i:
            off.append(error_line(subject.label, differences(motions[0], runs), runs[0].times, i))
    what = "velocity" if mode is CommandMode.VELOCITY else "way"
    panels = [Panel(title="Step response of each joint", x_label="s", y_label=f"{what} / jump", lines=tuple(moved))]
    if limits is not None:
        panels.append(
            Panel(title="Times at which each drive is saturated", x_label="s", rows=tuple(names), lines=tuple(effort))
        )
    tolerance = tolerance_line("step_response", subjects)
    return (*panels, error_panel("Largest difference of any joint", off, unit, tolerance))


def _list(subject: Subject, values: Floats) -> str:
    names = subject.placement.model.joint_names
    return ", ".join(f"{name} {value:.4g}" for name, value in zip(names, values, strict=True))


def _percent(subject: Subject, shares: Floats) -> str:
    names = subject.placement.model.joint_names
    each = ", ".join(f"{name} {percent(share, 0)}" for name, share in zip(names, shares, strict=True))
    return f"{percent(shares.mean(), 0)} ({each})"
