"""Collects the facts that ``frobs show`` prints about a robot, from its description and its model file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from frobs_core import plugins
from frobs_core.contracts import joint_groups
from frobs_core.description import ALL, Robot
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.kernel.robot_file import is_robot_file
from frobs_core.models import JointType, RobotModel, find_reader, home_positions, is_model_file
from frobs_core.util.errors import FrobsError, check_name


def robot_of(name: str, keywords: Mapping[str, Any]) -> Robot | None:
    """Return the robot with the given name, model file or robot file, or None if no robot has this name.

    Args:
        name: Name or path.
        keywords: Keywords of a robot that is a file, such as ``xacro_args``.
    """
    if is_model_file(name) or is_robot_file(name):
        config = RobotConfig(robot=name, **keywords)
        described = config.describe()
        if "gripper" in keywords:
            described = find_reader(described.model).with_gripper(described, config.gripper)
        return described
    bare = name.removeprefix("robot:")
    if bare not in plugins.records("robot"):
        return None
    robot: Robot = plugins.get_record("robot", bare).load()
    return robot


def describe_file(robot: Robot) -> dict[str, Any]:
    """Return the facts about a robot model file.

    Raises:
        ModelFileError: The file cannot be read.
        UnknownNameError: The tool center point is not a link, or the home position names a joint that does not exist.
    """
    model = robot.read_model()
    home_positions(model, robot.home)
    if robot.tcp is not None:
        check_name(f"link of '{model.name}'", robot.tcp, [link.name for link in model.links])
    return {"kind": "robot file", "name": robot.name, **describe_robot(robot)}


def describe_robot(robot: Robot) -> dict[str, Any]:
    """Return the facts about a robot, including ``error`` if the robot's model file cannot be read."""
    facts: dict[str, Any] = {"model": robot.model, "base": robot.base, "tcp": robot.tcp}
    try:
        model = robot.read_model()
        grouped = [
            {"group": name, "joints": list(names), "default_controller": robot.default_controllers.get(name)}
            for name, names in joint_groups(robot, model).items()
        ]
    except FrobsError as error:
        return {**facts, "error": str(error)}
    facts |= {
        "dof": len(model.actuated_joints),
        "links": len(model.links),
        "mass": f"{sum(link.inertial.mass for link in model.links if link.inertial):.6g} kg",
        "notes": [{"about": note.element, "line": note.line, "note": note.text} for note in model.notes],
        "groups": grouped,
        "end_effectors": [
            {
                "end_effector": name,
                "arm": tool.arm or next(iter(robot.groups), ALL),
                "fingers": tool.group,
                "tcp": tool.tcp,
                "open": dict(tool.open),
                "closed": dict(tool.closed),
            }
            for name, tool in robot.end_effectors.items()
        ],
        "differential_drive": robot.differential_drive and asdict(robot.differential_drive),
        "joints": joints(model, robot.home),
        "sensors": sensors(robot),
    }
    return facts


def joints(model: RobotModel, home: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return a row for each actuated joint, with its limits and home position [rad or m, rad/s or m/s, N·m or N]."""
    rows = []
    for joint in model.actuated_joints:
        limits = joint.limits
        resting = 0.0 if limits.lower <= 0.0 <= limits.upper else (limits.lower + limits.upper) / 2.0
        rows.append(
            {
                "joint": joint.name,
                "type": joint.type.value,
                "lower": _finite(limits.lower),
                "upper": _finite(limits.upper),
                "velocity": _finite(limits.velocity),
                "effort": _finite(limits.effort),
                "home": home.get(joint.name, resting),
                "unit": "m" if joint.type is JointType.PRISMATIC else "rad",
            }
        )
    return rows


def sensors(robot: Robot) -> list[dict[str, Any]]:
    """Return a row for each sensor, with its measured quantity, unit and imperfections. Missing entries are None."""
    return [
        {
            "sensor": name,
            "type": sensor.type_name,
            "frame": sensor.frame,
            "width": sensor.width,
            "unit": sensor.unit,
            "rate": None if sensor.rate is None else f"{sensor.rate:g} Hz",
            "noise": sensor.noise or None,
            "resolution": sensor.resolution or None,
            "delay": f"{sensor.delay:g} s" if sensor.delay else None,
            "dropout": sensor.dropout or None,
            "measures": sensor.summary,
        }
        for name, sensor in robot.sensors.items()
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
