"""Trajectory execution settings, which the service ``/move_group/trajectory_execution/set_parameters`` changes."""

from __future__ import annotations

from typing import Any

SETTINGS: dict[str, float | bool] = {
    "allowed_execution_duration_scaling": 1.1,
    "allowed_goal_duration_margin": 0.5,
    "allowed_start_tolerance": 0.01,
    "execution_duration_monitoring": True,
}
"""MoveIt's default values by name. All numbers are doubles.

The duration margin is in seconds, and the start tolerance is in radians or meters.
"""


def changed(settings: dict[str, Any], config: Any) -> dict[str, float | bool]:
    """Return settings updated with the values of a ``dynamic_reconfigure/Config``, ignoring unknown names."""
    given = {entry.name: entry.value for entry in (*config.doubles, *config.bools)}
    merged = {**SETTINGS, **settings, **given}
    return {name: type(default)(merged[name]) for name, default in SETTINGS.items()}


def as_config(settings: dict[str, float | bool]) -> Any:
    """Convert settings to a ``dynamic_reconfigure/Config``."""
    from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter, GroupState

    return Config(
        bools=[BoolParameter(name, value) for name, value in settings.items() if isinstance(value, bool)],
        doubles=[DoubleParameter(name, value) for name, value in settings.items() if not isinstance(value, bool)],
        groups=[GroupState("Default", True, 0, 0)],
    )
