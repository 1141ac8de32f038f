"""Reader for the task YAML files of FRobs_RL's Kobuki tasks."""

from __future__ import annotations

from typing import Any

from frobs_core.util.errors import ParameterValueError
from frobs_core.util.validation import finite, non_negative, positive
from frobs_tasks_legacy.yaml import TaskFiles


def non_negative_integer(name: str, value: Any) -> int:
    """Validate and return a parameter that must be an integer ≥ 0.

    Raises:
        ConfigurationError: The value is not an integer ≥ 0.
    """
    number = non_negative(name, value)
    if number != int(number):
        raise ParameterValueError(name, value, "an integer of at least 0")
    return int(number)


WEIGHTS = (
    "step_reward",
    "multiplier_dist_reward",
    "angle_diff_reward_multiplier",
    "not_reached_midway_reward",
    "collision_reward",
)
"""Keys of the weights of the reward's terms."""

FILES = TaskFiles(
    folder="navigation",
    kind="world of FRobs_RL's Kobuki",
    roots={"maze": "kobuki_maze", "dynamic": "kobuki_dynamic", "empty": "kobuki_empty"},
    used={
        "lidar_samples": non_negative_integer,
        "tolerance_goal_pos": positive,
        "step_reward": finite,
        "multiplier_dist_reward": finite,
        "angle_diff_reward_multiplier": finite,
        "reached_midway_reward": finite,
        "not_reached_midway_reward": finite,
        "reached_goal_reward": finite,
        "collision_reward": finite,
        "collision_distance_threshold": non_negative,
    },
    ignored=("action_space", "observation_space", "time_step", "update_rate_multiplier"),
)
"""Task YAML files of FRobs_RL's Kobuki tasks."""
