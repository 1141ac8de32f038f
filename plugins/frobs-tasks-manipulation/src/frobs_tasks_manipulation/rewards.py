"""Pure functions and terms of which the rewards of the tasks consist."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.description import Rewards, RewardTerm
from frobs_core.util.arrays import Floats

HELD = "during the last hold_steps control steps before the time limit, "
"""Beginning of the tasks' success rules."""


def length(vector: Floats) -> Floats:
    """Return the lengths (n,) of vectors (n, k)."""
    return np.asarray(np.sqrt(sum((vector * vector).T)))


def nearness(distance: Floats, reach: float) -> Floats:
    """Return 1 − tanh(distance / reach): 1 at the goal, 0.24 at ``reach``, and 0 far away.

    Args:
        distance: Distances, (n,) [m], ≥ 0.
        reach: Distance at which the value has decreased to 0.24 [m].
    """
    return np.asarray(1.0 - np.tanh(distance / reach))


def lifted(task: Any, full: float) -> Floats:
    """Return the height of a task's object above the floor as a fraction of ``full`` [m], (num_envs,) in [0, 1]."""
    height = task.cube.pos[:, 2] - task.rest_height
    return np.asarray(np.minimum(np.maximum(height, 0.0), full) / full)


APPROACH = RewardTerm(
    function=lambda task: nearness(task.to_cube, 0.2),
    weight=0.2,
    meaning="1 − tanh(d / 0.2 m), where d is the distance from the tool to the cube",
)
GRIP = RewardTerm(
    function=lambda task: nearness(task.to_cube, task.size / 2),
    weight=0.3,
    meaning="1 − tanh(2 d / size), where size is the edge length of the cube",
)


def shaped(condition: str, bonus: float = 0.5, **terms: RewardTerm) -> Rewards:
    """Return a dense reward, which is the sum of terms and a bonus for success, and a sparse reward.

    Args:
        condition: The task's success condition, as in "0.5 if the cube is at the goal".
        bonus: Value of the term ``achieved`` while the success condition is met.
        terms: Other terms of the dense reward.
    """
    achieved = RewardTerm(function=lambda task: task.achieved, weight=bonus, meaning=f"1 if {condition}")
    unachieved = RewardTerm(
        function=lambda task: np.where(task.achieved, 0.0, -1.0), meaning=f"−1 unless {condition}, otherwise 0"
    )
    return {"dense": {**terms, "achieved": achieved}, "sparse": {"unachieved": unachieved}}
