"""Advice on porting the parts of a package that the migration does not convert."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Any

from frobs_rl_compat.migrate.migration import COUNTERPARTS, Migration
from frobs_rl_compat.migrate.package import OldPackage
from frobs_rl_compat.migrate.robot import RobotSource


def note_the_task(package: OldPackage, robot: RobotSource | None, made: Migration) -> None:
    """Record which parts of the old task are missing from the skeleton."""
    names = [*(old.name for old in package.lineage), package.name]
    id = next((COUNTERPARTS["examples"][name] for name in names if name in COUNTERPARTS["examples"]), None)
    made.leave(
        "the task",
        f"{id} reproduces FRobs_RL's example with the same name; train it, or port your changes as described below"
        if id
        else "arbitrary code cannot be translated; port the task as described in the rows below",
    )
    spaces, task_files = COUNTERPARTS["spaces"], COUNTERPARTS["task_files"]
    for old in package.lineage:
        for node in ast.walk(old.node):
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in spaces:
                advice = f"{spaces[ast.unparse(node.targets[0])]} ({old.path.name}, line {node.lineno})"
                made.leave(ast.unparse(node), advice)
    pose = {key: value for key, value in package.robot_arguments.items() if key.startswith(("model_pos", "model_ori_x",
            "model_ori_y", "model_ori_z")) and value}  # fmt: skip
    if pose:
        shown = ", ".join(f"{key}={value}" for key, value in pose.items())
        made.leave("the robot's pose in the world frame", f"in task.py, pass robot_pose=… to Scene with {shown}")
    if robot is not None and robot.wheels is not None:
        made.leave("the maximum speeds", "in robot.py, replace the guessed maximum speeds in differential_drive")
    for path, mapping in package.yaml.numbers.items():
        for root in mapping:
            if root in task_files:
                made.leave(f"the task '{root}' ({path.name})", f"{task_files[root]} accepts {path.name} as config_file")
    for path, mapping in package.yaml.controllers.items():
        for name, type in _types(mapping):
            controller = next((ours for part, ours in COUNTERPARTS["controllers"].items() if part in type), None)
            if controller is not None:
                made.leave(f"controller {name} ({type}, {path.name})", f"plugin.py: controller={controller}")
    if any("moveit" in ast.unparse(old.tree).lower() for old in package.lineage):
        made.leave(
            "MoveIt",
            'in plugin.py, set controller="trajectory" (from frobs-controllers-planning) to plan and execute motions',
        )
    for topic in _topics(package):
        made.leave(topic, "instead of topics, use the robot's state in control.robot('robot'), or a Sensors object")
    for launch in sorted(package.folder.rglob("*.launch")):
        made.leave(
            launch.name, "FRobs does not use launch files; move the computations of the launched nodes to the task"
        )
    for world in sorted(package.folder.rglob("*.world")):
        made.leave(world.name, "define the bodies, the floor and the cameras in the task's scene")
    if package.hook("_check_subs_and_pubs_connection") is not None:
        made.leave(
            "_check_subs_and_pubs_connection", "nothing to do, because a simulation is ready as soon as it is created"
        )


def note_what_is_left(package: OldPackage, made: Migration) -> None:
    """Record which parts of a package are missing from the plugin."""
    for path, reason in {**package.python.unread, **package.yaml.unread}.items():
        made.leave(path.name, f"could not be read: {reason}")
    for id in package.others:
        made.leave(f"ID {id}", f"migrate this environment separately with --id {id} --name OTHER_NAME")
    if package.wrappers:
        made.leave(
            ", ".join(package.wrappers),
            "actions are already in [−1, 1]; to normalize observations with finite bounds, add wrappers: [{name: "
            "'frobs_rl_compat.wrappers:NormalizeObservationWrapper'}] to train.yaml",
        )


def _types(mapping: Mapping[str, Any]) -> list[tuple[str, str]]:
    types = []
    for name, value in mapping.items():
        if isinstance(value, Mapping):
            type = value.get("type")
            types += [(name, str(type))] if isinstance(type, str) else _types(value)
    return types


def _topics(package: OldPackage) -> list[str]:
    topics = []
    for old in package.lineage:
        for node in ast.walk(old.node):
            if (
                isinstance(node, ast.Call)
                and ast.unparse(node.func) in ("rospy.Subscriber", "rospy.Publisher")
                and node.args
            ):
                kind = ast.unparse(node.func).removeprefix("rospy.").lower()
                topics.append(f"{kind} of {ast.unparse(node.args[0])}")
    return list(dict.fromkeys(topics))
