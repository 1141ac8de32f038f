"""Describes what was found in a robot's model file, and how a task was fitted to the robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from frobs_cli.facts import dotted
from frobs_cli.parameters import descriptions

CHANGE = "--set environment_kwargs.SETTING=VALUE changes a setting; --gripper, --attach and --tcp describe the robot"


def fit_rows(keywords: Mapping[str, Any], fixed: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a row for each setting that was found or fitted.

    Args:
        keywords: All keywords of an environment, including those of its ID.
        fixed: The settings, from :func:`frobs_core.kernel.fitting.fixed_keywords`.

    Returns:
        Dictionaries with ``setting`` (the key of ``environment_kwargs``), ``value`` and ``help``.
    """
    from frobs_core.kernel.config import EnvConfig
    from frobs_core.kernel.robot_config import RobotKeywords, find_record
    from frobs_core.plugins.records import ControllerRecord, TaskRecord
    from frobs_models import StatedGripper

    config = EnvConfig.from_dict(keywords)
    meanings = {name: text for name, text in descriptions(RobotKeywords).items() if name == "home"}
    meanings |= descriptions(find_record(TaskRecord, config.task).load())
    if isinstance(config.controller, str) and config.controller:
        controller = descriptions(find_record(ControllerRecord, config.controller).load())
        meanings |= {f"controller_kwargs.{name}": text for name, text in controller.items()}
    meanings |= {f"gripper.{name}": text for name, text in descriptions(StatedGripper).items()}
    meanings |= {"gripper.tcp.pos": "Position of the tool center point relative to the palm [m]."}
    meanings |= {"gripper.tcp.rpy": "Its orientation: z is the direction of approach, fingers close along y [rad]."}
    rows = {
        **dotted({key: value for key, value in fixed.items() if key not in ("fit", "home")}),
        "home": fixed.get("home"),
    }
    return [
        {
            "setting": name,
            "value": _rounded(value),
            "help": _first_sentence(meanings.get(name) or meanings.get(name.rpartition(".")[0], "")),
        }
        for name, value in rows.items()
        if value is not None
    ]


def _rounded(value: Any) -> Any:
    """Return a value whose numbers have at most four decimals."""
    if isinstance(value, Mapping):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return round(value, 4) + 0.0 if isinstance(value, float) else value


def _first_sentence(text: str) -> str:
    return text.partition(". ")[0].rstrip(".")
