"""Replays an action file in the complete environment on every simulator."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_devkit.parity.actions import ActionFile
from frobs_devkit.parity.motion import worst_joint
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, error_panel
from frobs_devkit.parity.rollout import AFTER_A_TOUCH, Rollout, free_steps, play
from frobs_devkit.parity.tolerances import TOLERANCES
from frobs_devkit.parity.under_test import Pair, Subject, follows_exactly, pairs_of, tolerance_line


def replay(subjects: Sequence[Subject], file: ActionFile) -> Measurement:
    """Compare the joint and tool positions after each control step, and the number of steps in the episode."""
    names, unit = subjects[0].placement.model.joint_names, subjects[0].joint_unit
    rollouts = [play(subject, [(file.seed, file.actions)])[0] for subject in subjects]
    first = rollouts[0]
    free = free_steps(subjects[0], first)
    comparisons: list[Comparison] = []
    joints, joint_errors, tool_errors = [], [], []
    for i, rollout in enumerate(rollouts):
        moved = rollout.joints - rollout.joints[:1]
        joints += [Line(name, rollout.times, moved[:, j], j, i) for j, name in enumerate(names)]
    for i, (pair, rollout) in enumerate(zip(pairs_of(subjects), rollouts[1:], strict=True), 1):
        comparisons += _judge(pair, first, rollout, free)
        n = min(first.steps, rollout.steps) + 1
        off = np.abs(first.joints[:n] - rollout.joints[:n]).max(axis=1)
        joint_errors.append(Line(pair.other.label, rollout.times[:n], off, i))
        tool_errors.append(Line(pair.other.label, rollout.times[:n], _apart(first, rollout), i))
    exact = follows_exactly(*subjects)
    joint_tolerance, tool_tolerance = (
        tolerance_line("replay_joints", subjects),
        TOLERANCES["replay_tool"].allowed(exact),
    )
    return Measurement(
        summary=f"The {len(file.actions)} actions of actions.json are replayed after a reset with seed {file.seed} in "
        "the complete environment: controller, drives, robot, scene and task.",
        comparisons=tuple(comparisons),
        facts={
            "steps": ", ".join(f"{s.label} {r.steps}" for s, r in zip(subjects, rollouts, strict=True)),
            "moved freely": f"{free} of {first.steps} steps",
        },
        panels=(
            Panel(title="Each joint", x_label="s", y_label=f"{unit} from the start", lines=tuple(joints)),
            error_panel("Largest difference of any joint", joint_errors, unit, joint_tolerance),
            error_panel("Distance between the tool positions", tool_errors, "m", tool_tolerance),
        ),
    )


def _judge(pair: Pair, first: Rollout, second: Rollout, free: int) -> Iterator[Comparison]:
    """Yield the comparisons of the robot's free motion, of the motion after a contact, and of the episode's end."""
    names, unit = pair.reference.placement.model.joint_names, pair.reference.joint_unit
    n = min(first.steps, second.steps) + 1
    errors = np.abs(first.joints[:n] - second.joints[:n])  # (steps + 1, dof)
    apart, times = _apart(first, second), first.times
    reached = float(np.abs(first.joints - first.joints[:1]).max())
    split = min(free + 1, n)
    for part, begin, end in (("", 0, split), (AFTER_A_TOUCH, split, n)):
        if begin == end:
            continue
        if end == 1:  # the only free state is the state after the reset
            reason = "inconclusive: the robot did not move freely for even one step"
            yield pair.skip(reason, "joint positions")
            continue
        exact = False if part else None  # contacts are modeled differently by each engine
        off, where = errors[begin:end], worst_joint(errors[begin:end], names, times[begin:end])
        what = f"joint positions{part}"
        yield pair.judge("replay_joints", what, off, exact=exact, scale=reached, where=where, unit=unit)
        latest = int(np.argmax(np.nan_to_num(apart[begin:end], nan=np.inf))) + begin
        where = f"at {times[latest]:.2f} s"
        yield pair.judge("replay_tool", f"tool position{part}", apart[begin:end], exact=exact, where=where)
    if first.ended or second.ended:
        where = f"after {second.steps} instead of {first.steps} steps"
        yield pair.judge("episode_end", "end of the episode", float(abs(first.steps - second.steps)), where=where)


def _apart(first: Rollout, second: Rollout) -> Floats:
    """Return the distances between the tool positions of two rollouts, (steps + 1,) [m]."""
    n = min(first.steps, second.steps) + 1
    return np.asarray(np.linalg.norm(first.tool[:n] - second.tool[:n], axis=1))
