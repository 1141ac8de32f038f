"""Applies the same actions to an environment on several simulators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.kernel.env import RobotEnv
from frobs_core.util.arrays import Floats
from frobs_devkit.parity.under_test import Subject

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
