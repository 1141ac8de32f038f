"""Writes what was found in a robot's model file as a robot file, so that it can be edited."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from frobs_cli.parameters import descriptions
from frobs_core.kernel.robot_file import at_link, device_and_link, is_path
from frobs_core.util.plain import to_json
from frobs_devkit.doctor.robot_report import RobotReport
from frobs_models import Gripper, StatedGripper

_HEAD = """\
# Robot file of FRobs. Use it like a model file: --robot {name}, or robot="{name}" in Python.
# Lengths are in m, and angles in rad. You can delete each line: the value is then found or derived again.
# Lines that are commented out show the defaults.
"""
_REASONS = {
    "joints": "They are behind the palm, and move a part by more than 4 mm.",
    "arm": "They lead from the root to the palm.",
    "palm": "It is the last link before the fingers.",
    "pads": "They are the links that face each other.",
    "fixed_jaw": "The last joint of a chain without branches is a single jaw.",
    "tcp": "It is between the pads when they hold an object of {size} mm.",
    "open": "The gap was measured at 41 positions between the limits.",
    "closed": "The gap was measured at 41 positions between the limits.",
    "gap": "It was measured between the inner faces of the pads.",
    "levers": "They were measured at an object of {size} mm.",
}


def robot_file_text(report: RobotReport, robot: str, settings: Mapping[str, Any], file: Path) -> str:
    """Return the text of a robot file for a robot, which is a name or a model file.

    The settings are other keys of a robot file. The gripper is that of the report. Paths in the text are relative to its
    folder.
    """
    lines = [_HEAD.format(name=file.name), f"robot: {to_json(_relative(robot, file))}"]
    for name, value in settings.items():
        if name == "gripper":
            continue
        if name == "package_paths":
            value = {package: _relative(str(folder), file) for package, folder in value.items()}
        elif name == "attach" and isinstance(value, Mapping):
            value = {**value, "robot": _relative(str(value["robot"]), file)}
        elif name == "attach":
            device, link = device_and_link(str(value))
            value = at_link(_relative(device, file), link)
        lines.append(f"{name}: {to_json(value)}")
    home = {joint.name: joint.home for joint in report.joints if joint.home is not None and not joint.mimic}
    lines += [
        "",
        "# How the root link can move: fixed, floating or wheeled.",
        "# base: fixed",
        "",
        "# Tool center point: the last link of the longest chain, without fingers. Tasks that grasp use gripper.tcp",
        "# instead, unless you set a link here.",
        f"# tcp: {to_json(report.tools[0].link)}",
        "",
        "# Rest position of each joint: 0, or the middle of its limits. Tasks that grasp derive their own.",
        f"# home: {to_json(home)}",
        "",
    ]
    if report.gripper is None:
        lines.append(f"# gripper: none was found, because {_one_line(report.no_gripper)}.")
    else:
        lines += ["# Joint groups: 'arm' with gripper.arm, and 'gripper' with gripper.joints.", "gripper:"]
        lines += _gripper(report.gripper)
    return "\n".join(lines) + "\n"


def _gripper(gripper: Gripper) -> Iterator[str]:
    meanings, size = descriptions(StatedGripper), f"{1000.0 * gripper.object_size:.0f}"
    for name, value in gripper.statement().items():
        reason = "" if name == "fixed_jaw" and not value else _REASONS.get(name, "").format(size=size)
        yield from (f"  # {sentence}" for sentence in (meanings[name], reason) if sentence)
        if isinstance(value, dict):
            yield f"  {name}:"
            yield from (f"    {key}: {to_json(item)}" for key, item in value.items())
        else:
            yield f"  {name}: {to_json(value)}"
    yield from (f"  # Note: {_one_line(note)}." for note in gripper.notes)


def _one_line(text: str) -> str:
    """Return a text without line ends, which names in a model file can contain and which would end a comment."""
    return " ".join(text.split())


def _relative(path: str, file: Path) -> str:
    return os.path.relpath(Path(path).expanduser().resolve(), file.resolve().parent) if is_path(path) else path
