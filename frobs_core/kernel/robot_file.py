"""Robot files in YAML: the keywords of one robot, such as the model file and what is stated about its gripper."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any

from frobs_core.models.load import is_model_file
from frobs_core.util.errors import ConfigFileError, nearest

SUFFIXES = (".yaml", ".yml")
KEYS = (
    "robot",
    "xacro_args",
    "package_paths",
    "attach",
    "gripper",
    "home",
    "tcp",
    "base",
    "sensors",
    "differential_drive",
)
"""Keys of a robot file, which are keywords of :class:`~frobs_core.kernel.robot_config.RobotKeywords`."""


def is_robot_file(robot: object) -> bool:
    """Return whether a robot is the path of a YAML file."""
    return isinstance(robot, str | PurePath) and PurePath(robot).suffix.lower() in SUFFIXES


def read_robot_file(path: str | Path) -> dict[str, Any]:
    """Return the keywords in the robot file ``path``. Relative paths in it are relative to its folder.

    Raises:
        ConfigFileError: The file cannot be read, has an unknown key, or does not name the robot.
    """
    from frobs_core.util.yaml import load_yaml, merge  # imports PyYAML

    path = Path(path).expanduser()
    values = load_yaml(path)
    for key in values:
        if key not in KEYS:
            close = nearest(key, KEYS)
            meant = f"did you mean '{close}'?" if close else f"the keys are {', '.join(KEYS)}."
            raise ConfigFileError(*values.origins[key], f"a robot file has no key '{key}'; {meant}")
    robot = values.get("robot")
    if not isinstance(robot, str) or not robot or is_robot_file(robot):
        file, line = values.origins.get("robot", (path, None))
        reason = "'robot' must be the path of a model file, relative to this file, or a robot's name."
        raise ConfigFileError(file, line, reason)
    keywords: dict[str, Any] = {**values, "robot": _beside(path, robot)}
    folders, attached = values.get("package_paths"), values.get("attach")
    if isinstance(folders, Mapping):
        keywords["package_paths"] = {name: _beside(path, str(folder)) for name, folder in folders.items()}
    if isinstance(attached, Mapping) and "robot" in attached:
        keywords["attach"] = merge(attached, {"robot": _beside(path, str(attached["robot"]))})
    elif isinstance(attached, str):
        device, link = device_and_link(attached)
        keywords["attach"] = at_link(_beside(path, device), link)
    return keywords


def device_and_link(attach: str) -> tuple[str, str]:
    """Return the gripper and the link of ``attach``, such as ``"GRIPPER@LINK"``.

    The link is ``""`` if it is not stated, and a path may contain ``@``.
    """
    device, at, link = attach.rpartition("@")
    return (device, link) if at and not is_model_file(attach) else (attach, "")


def at_link(device: str, link: str) -> str:
    """Return the text that :func:`device_and_link` divides into a ``device`` and a ``link``."""
    return f"{device}@{link}" if link else device


def is_path(name: str) -> bool:
    """Return whether a name is a path, rather than the name of a robot or of a file in a Python package."""
    return ("/" in name or "." in name) and (":" not in name or Path(name).is_absolute())


def _beside(path: Path, name: str) -> str:
    return str((path.parent / Path(name).expanduser()).resolve()) if is_path(name) else name


def absolute_files(keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Return keywords in which the files of a robot, of an attached gripper and of an object have absolute paths."""
    changed = dict(keywords)
    for name in ("robot", "attach", "object"):
        value = keywords.get(name)
        if isinstance(value, str) and value:
            path, link = device_and_link(value) if name == "attach" else (value, "")
            if Path(path).is_file():
                changed[name] = at_link(str(Path(path).resolve()), link)
    return changed
