"""Replays an action file in the complete environment on every simulator."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_devkit.parity.actions import ActionFile
from frobs_devkit.parity.motion import worst_joint
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, judge, skip
from frobs_devkit.parity.rollout import AFTER_A_TOUCH, Rollout, free_steps, play
from frobs_devkit.parity.tolerances import TOLERANCES
from frobs_devkit.parity.under_test import Subject, follows_exactly


def replay(subjects: Sequence[Subject], file: ActionFile) -> Measurement:
    """Compare the joint and tool positions after each control step, and the number of steps in the episode."""
    names, unit = subjects[0].placement.model.joint_names, subjects[0].joint_unit
    rollouts = [play(subject, [(file.seed, file.actions)])[0] for subject in subjects]
    first = rollouts[0]
    free = free_steps(subjects[0], first)
    comparisons: list[Comparison] = []
    joints, joint_errors, tool_errors = [], [], []
    for i, (subject, rollout) in enumerate(zip(subjects, rollouts, strict=True)):
        moved = rollout.joints - rollout.joints[:1]
        joints += [Line(name, rollout.times, moved[:, j], j, i) for j, name in enumerate(names)]
        if i == 0:
            continue
        comparisons += _judge(subjects[0], subject, first, rollout, free)
        n = min(first.steps, rollout.steps) + 1
        off = np.abs(first.joints[:n] - rollout.joints[:n]).max(axis=1)
        joint_errors.append(Line(subject.label, rollout.times[:n], off, i))
        tool_errors.append(Line(subject.label, rollout.times[:n], _apart(first, rollout), i))
    exact = follows_exactly(*subjects)
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
            Panel(
                title="Largest difference of any joint",
                x_label="s",
                y_label=unit,
                lines=tuple(joint_errors),
                tolerance=TOLERANCES["replay_joints"].exact if exact else None,
                log=True,
            ),
            Panel(
                title="Distance between the tool positions",
                x_label="s",
                y_label="m",
                lines=tuple(tool_errors),
                tolerance=TOLERANCES["replay_tool"].allowed(exact),
                log=True,
            ),
        ),
    )


def _judge(reference: Subject, subject: Subject, first: Rollout, second: Rollout, free: int) -> Iterator[Comparison]:
    """Yield the comparisons of the robot's free motion, of the motion after a contact, and of the episode's end."""
    exact, n = follows_exactly(reference, subject), min(first.steps, second.steps) + 1
    errors = np.abs(first.joints[:n] - second.joints[:n])  # (steps + 1, dof)
    apart, times = _apart(first, second), first.times
    reached = float(np.abs(first.joints - first.joints[:1]).max())
    split = min(free + 1, n)
    for part, begin, end in (("", 0, split), (AFTER_A_TOUCH, split, n)):
        if begin == end:
            continue
        if end == 1:  # the only free state is the state after the reset
            reason = "inconclusive: the robot did not move freely for even one step"
            yield skip(subject.label, reference.label, reason, "joint positions")
            continue
        names = reference.placement.model.joint_names
        yield judge(
            "replay_joints", f"joint positions{part}", subject.label, reference.label, errors[begin:end],
            exact=exact and not part, scale=reached, where=worst_joint(errors[begin:end], names, times[begin:end]), unit=reference.joint_unit,
        )  # fmt: skip
        latest = int(np.argmax(np.nan_to_num(apart[begin:end], nan=np.inf))) + begin
        yield judge(
            "replay_tool", f"tool position{part}", subject.label, reference.label, apart[begin:end],
            exact=exact and not part, where=f"at {times[latest]:.2f} s",
        )  # fmt: skip
    if first.ended or second.ended:
        yield judge(
            "episode_end", "end of the episode", subject.label, reference.label, float(abs(first.steps - second.steps)),
            exact=exact, where=f"after {second.steps} instead of {first.steps} steps",
        )  # fmt: skip


def _apart(first: Rollout, second: Rollout) -> Floats:
    """Return the distances between the tool positions of two rollouts, (steps + 1,) [m]."""
    n = min(first.steps, second.steps) + 1
    return np.asarray(np.linalg.norm(first.tool[:n] - second.tool[:n], axis=1))
