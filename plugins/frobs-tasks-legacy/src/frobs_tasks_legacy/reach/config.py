"""Reader for the task YAML files of FRobs_RL's reaching tasks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from frobs_core.util.errors import ParameterValueError
from frobs_core.util.validation import boolean, finite, non_negative, number_list, positive
from frobs_tasks_legacy.yaml import TaskFiles

_AXES = ("x", "y", "z")
_DYNAMIC = tuple(f"{axis}_max_{what}" for what in ("amplitude", "freq") for axis in _AXES)


def axes(name: str, value: Any) -> tuple[float, ...]:
    """Return a vector from a mapping with the keys ``x``, ``y`` and ``z``, or from three numbers.

    Raises:
        ConfigurationError: The value is neither a mapping with the keys ``x``, ``y`` and ``z`` nor a list of three
            numbers.
    """
    if isinstance(value, Mapping):
        _check_keys(name, value, _AXES)
        value = [value[axis] for axis in _AXES]
    return number_list(name, value, 3)


def dynamic(name: str, value: Any) -> dict[str, float]:
    """Validate and return the six numbers in ``pos_dynamic_params``.

    Raises:
        ConfigurationError: A key is missing or unknown, or a number is negative.
    """
    if not isinstance(value, Mapping):
        raise ParameterValueError(name, value, f"a mapping with {', '.join(_DYNAMIC)}")
    _check_keys(name, value, _DYNAMIC)
    return {key: non_negative(f"{name}.{key}", value[key]) for key in _DYNAMIC}


FILES = TaskFiles(
    folder="reach",
    kind="profile of FRobs_RL's reachers",
    roots={"irb120": "irb120", "irb140": "irb140", "irb140_velocity": "irb140", "ur5": "ur5"},
    used={
        "min_joint_pos": number_list,
        "max_joint_pos": number_list,
        "position_goal_min": axes,
        "position_goal_max": axes,
        "tolerance_goal_pos": positive,
        "training": boolean,
        "pos_dynamic": boolean,
        "pos_dynamic_params": dynamic,
        "step_reward": finite,
        "multiplier_dist_reward": finite,
        "reached_goal_reward": finite,
        "joint_limits_reward": finite,
    },
    ignored=(
        "n_actions",
        "n_observations",
        "max_steps",
        "position_ee_min",
        "position_ee_max",
        "max_distance",
        "time_step",
        "update_rate_multiplier",
        "goal_ee_pos",
        "limit_joint_vel",
        "tolerance_goal_ori",
        "multiplier_ori_reward",
    ),
)
"""Task YAML files of FRobs_RL's reaching tasks."""


def _check_keys(name: str, value: Mapping[str, Any], expected: tuple[str, ...]) -> None:
    if set(value) != set(expected):
        raise ParameterValueError(f"the keys of {name}", list(value), ", ".join(expected))
