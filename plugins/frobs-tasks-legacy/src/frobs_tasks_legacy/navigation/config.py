"""Reading the task YAML of FRobs_RL's Kobuki."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from frobs_core.errors import ParameterValueError, UnknownNameError
from frobs_core.validation import finite, non_negative, positive
from frobs_tasks_legacy.yaml import Readers, read_values

WORLDS: Mapping[str, str] = {"maze": "kobuki_maze", "dynamic": "kobuki_dynamic", "empty": "kobuki_empty"}
"""FRobs_RL's worlds, with the key under which a task's file has everything."""

IGNORED = ("action_space", "observation_space", "time_step", "update_rate_multiplier")
"""Keys that FRobs_RL's files have and that change nothing here."""


def whole(name: str, value: Any) -> int:
    """Return a parameter that must be a whole number, 0 or above.

    Raises:
        ConfigurationError: It is not.
    """
    number = non_negative(name, value)
    if number != int(number):
        raise ParameterValueError(name, value, "a whole number")
    return int(number)


USED: Readers = {
    "lidar_samples": whole,
    "tolerance_goal_pos": positive,
    "step_reward": finite,
    "multiplier_dist_reward": finite,
    "angle_diff_reward_multiplier": finite,
    "reached_midway_reward": finite,
    "not_reached_midway_reward": finite,
    "reached_goal_reward": finite,
    "collision_reward": finite,
    "collision_distance_threshold": non_negative,
}
"""Keys that mean something, with what checks and reads their values."""


def read(world: str, config_file: str | Path | None, keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Return a value for each key of :data:`USED`: a keyword's, else the file's, else FRobs_RL's own.

    Args:
        world: Of :data:`WORLDS`.
        config_file: A task YAML of FRobs_RL, unchanged; None: none.
        keywords: By key; those that are None are not given, and others are ignored.

    Raises:
        ConfigFileError: The file cannot be read, or has an unknown key or an unusable value; names file and line.
        ConfigurationError: A keyword has an unusable value.
        UnknownNameError: There is no such world.
    """
    if world not in WORLDS:
        raise UnknownNameError("world of FRobs_RL's Kobuki", world, WORLDS)
    own = Path(str(files("frobs_tasks_legacy"))) / "navigation" / "tasks" / f"{world}.yaml"
    paths = (own,) if config_file is None else (own, config_file)
    return read_values(paths, WORLDS[world], USED, IGNORED, keywords)
