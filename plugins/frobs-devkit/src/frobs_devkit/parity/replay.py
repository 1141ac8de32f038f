"""Applies the same actions to the complete environment on every simulator, and compares what happens."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.kernel.env import RobotEnv
from frobs_core.util.arrays import Floats
from frobs_devkit.parity.actions import ActionFile
from frobs_devkit.parity.motion import worst_joint
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, error_panel
from frobs_devkit.parity.tolerances import TOLERANCES
from frobs_devkit.parity.under_test import Pair, Subject, follows_exactly, pairs_of, tolerance_line

_PREFIX = "frobs/reward/"
AFTER_A_TOUCH = ", after a touch"
"""Suffix for the names of quantities that depend on contacts, which each engine models differently."""

_SAME = 1e-9  # [rad or m] maximum difference between two motions that are considered equal


@dataclass(frozen=True)
class Rollout:
    """Recorded data of one episode."""

    times: Floats  # (steps + 1,) [s], starting with the reset
    joints: Floats  # joint positions, (steps + 1, dof) [rad or m]
    tool: Floats  # tool positions in the world frame, (steps + 1, 3) [m]
    rewards: dict[str, Floats]  # the total "reward" and all reward terms by name, (steps,) each
    ended: bool  # whether the episode terminated, or the simulation diverged
    commands: Floats  # from the controller, (steps, rows, dof); a command that is held during a step has one row

    @property
    def steps(self) -> int:
        """Number of control steps in the episode."""
        return len(self.times) - 1


def play(subject: Subject, episodes: Sequence[tuple[int, np.ndarray[Any, Any]]]) -> list[Rollout]:
    """Run each episode, defined by a seed and actions, until the episode ends or all actions are used."""
    with subject.make() as env:
        return [_play(env, seed, actions) for seed, actions in episodes]


def _play(env: RobotEnv, seed: int, actions: np.ndarray[Any, Any]) -> Rollout:
    env.reset(seed=seed)
    commands: list[Floats] = []
    follow = type(env.robot).command

    def overhear(values: Floats) -> None:
        commands.append(np.array(values[0], ndmin=2))
        follow(env.robot, values)

    env.robot.command = overhear  # type: ignore[method-assign]
    joints, tool = [env.robot.joint_positions[0].copy()], [env.robot.frame_pose("tcp")[0][0].copy()]
    rewards: dict[str, list[float]] = {}
    ended = False
    for action in actions:
        _, reward, terminated, diverged, info = env.step(action)
        joints.append(env.robot.joint_positions[0].copy())
        tool.append(env.robot.frame_pose("tcp")[0][0].copy())
        terms = {key.removeprefix(_PREFIX): value for key, value in info.items() if key.startswith(_PREFIX)}
        for name, value in {"reward": reward, **terms}.items():
            rewards.setdefault(name, []).append(float(value))
        ended = terminated or diverged
        if ended:
            break
    return Rollout(
        env.control_timestep * np.arange(float(len(joints))),
        np.array(joints),
        np.array(tool),
        {name: np.array(values) for name, values in rewards.items()},
        ended,
        np.array(commands),
    )


def free_steps(subject: Subject, rollout: Rollout) -> int:
    """Return the number of steps before the robot touched something or a joint reached its limit.

    The same commands are replayed in an empty scene. The robot moves freely as long as both motions are equal.
    """
    lower, upper = np.array([(j.limits.lower, j.limits.upper) for j in subject.placement.model.actuated_joints]).T
    with subject.simulate(subject.alone()) as (simulation, robot):
        robot.write_joint_state(rollout.joints[:1])
        for step, command in enumerate(rollout.commands):
            # Check every physics step, because a joint may reach its limit within an action.
            for k in range(subject.decimation):
                if k < len(command):
                    robot.command(command[k : k + 1])
                simulation.step(1)
                now = robot.joint_positions[0]
                if (now <= lower).any() or (now >= upper).any():
                    return step
            if not np.abs(now - rollout.joints[step + 1]).max() < _SAME:
                return step
    return rollout.steps


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
