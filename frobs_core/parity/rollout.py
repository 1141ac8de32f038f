"""Playing the same actions through an environment on several simulators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.env import RobotEnv
from frobs_core.parity.subject import Subject

_PREFIX = "frobs/reward/"


@dataclass(frozen=True)
class Rollout:
    """What one episode did.

    Attributes:
        times: (steps + 1,) [s], the reset first.
        joints: (steps + 1, dof) [rad or m]
        tool: (steps + 1, 3) [m] in the world.
        rewards: ``"reward"`` and each of its terms, (steps,).
        ended: Whether the episode terminated, or the engine gave up.
    """

    times: Floats
    joints: Floats
    tool: Floats
    rewards: dict[str, Floats]
    ended: bool

    @property
    def steps(self) -> int:
        """How many steps were taken."""
        return len(self.times) - 1


def play(subject: Subject, episodes: Sequence[tuple[int, np.ndarray[Any, Any]]]) -> list[Rollout]:
    """Play episodes, each until it ends or its actions do.

    Args:
        subject: The simulator.
        episodes: For each the seed of its reset, and its actions (steps, …).
    """
    with subject.make() as env:
        return [_play(env, seed, actions) for seed, actions in episodes]


def _play(env: RobotEnv, seed: int, actions: np.ndarray[Any, Any]) -> Rollout:
    env.reset(seed=seed)
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
    )


def common_steps(first: Rollout, second: Rollout) -> int:
    """Return how many steps both took."""
    return min(first.steps, second.steps)
