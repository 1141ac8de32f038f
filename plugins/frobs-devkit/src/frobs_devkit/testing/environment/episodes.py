"""Functions that play the episodes in which checks examine rewards and success."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.util.errors import FrobsError
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.under_test import achieved_goal

RANDOM_STEPS = 120
PATH = 25  # number of steps for which an action is held
_PATHS = 8


def longest_path(env: Any) -> tuple[Any, list[Any]]:
    """Hold each of several actions; return the action that leads farthest, with the achieved goal after each step."""
    paths = [(action, _path(env, action)) for action in draw_actions(env.action_space, _PATHS, seed=5)]
    return max(paths, key=lambda path: float(np.linalg.norm(path[1][-1] - path[1][0])))


def _path(env: Any, action: Any) -> list[Any]:
    observation, _ = env.reset(seed=5)
    path = [achieved_goal(env, observation)]
    for _ in range(PATH):
        observation, _, terminated, truncated, _ = env.step(action)
        path.append(achieved_goal(env, observation))
        if terminated or truncated:
            break
    return path


def begin_with_goal(env: Any, goal: Any) -> bool:
    """Begin an episode like those of :func:`longest_path` with a goal, and return whether the task accepts the goal."""
    for part in (goal, goal[:2]):  # goals are positions in space or on the floor
        try:
            env.reset(seed=5, options={"goal": part})
        except (FrobsError, ValueError):
            continue
        return True
    return False


def random_steps(
    env: Any, options: dict[str, Any] | None = None, count: int = RANDOM_STEPS
) -> list[tuple[Any, float, dict[str, Any]]]:
    """Play random episodes, and return (observation, reward, info) for each step."""
    env.reset(seed=8, options=options)
    steps = []
    for action in draw_actions(env.action_space, count, seed=8):
        observation, reward, terminated, truncated, info = env.step(action)
        steps.append((observation, float(reward), dict(info)))
        if terminated or truncated:
            env.reset()
    return steps
