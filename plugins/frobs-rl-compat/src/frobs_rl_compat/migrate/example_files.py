"""Edits the files of a plugin that uses one of FRobs's tasks with a package's parameters."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from frobs_core import plugins
from frobs_core.plugins.records import TaskRecord
from frobs_core.util.yaml import dump_yaml
from frobs_rl_compat.migrate.examples import Example
from frobs_rl_compat.migrate.migration import Migration
from frobs_rl_compat.migrate.package import OldPackage
from frobs_rl_compat.migrate.yaml_files import literal

_REQUIREMENT = '  "frobs-tasks-legacy>=0.3,<0.4",\n'


def write_example(
    example: Example, package: OldPackage, folder: Path, sources: Path, context: Mapping[str, Any], made: Migration
) -> None:
    """Configure a rendered plugin to use the FRobs task that is equivalent to a recognized package's task.

    Args:
        example: FRobs's equivalent task and its parameters.
        package: The package.
        folder: The plugin's folder.
        sources: The folder of the plugin's Python package.
        context: Answers to the template's questions, which were used to render the plugin.
        made: Report to which this function adds the migrated parts and the differences.
    """
    record = plugins.get_record("task", example.task)
    assert isinstance(record, TaskRecord)
    old = package.lineage[0]
    parameters = dict(example.parameters)
    if example.floor_plan:
        parameters["floor_plan"] = f"{sources.name}:floor_plan.yaml"
        text = (
            f"# World of {old.name} from the ROS package {package.name}. Lengths are in m, angles in degrees, and "
            "times in s.\n"
        )
        (sources / "floor_plan.yaml").write_text(text + dump_yaml(example.floor_plan), "utf-8")
        made.carry("walls, boxes, start, goals or waypoints", f"src/{sources.name}/floor_plan.yaml")
    _edit(
        sources / "plugin.py",
        (r'entry_point="[\w.]+\.task:\w+"', f'entry_point="{record.entry_point}"'),
        (r'(name="\w+",\n +summary=)"[^"]+"(?=,\n +entry_point="frobs_tasks)', rf'\1"{old.name} of FRobs_RL"'),
        (r' summary="[^"]+",\n( +robot=)', rf' summary="{old.name} of the ROS package {package.name}",\n\1'),
        (r"needs={.*}", f"needs={_needs(record)}"),
        (r'( +)controller="\w+",\n', rf'\1controller="{example.controller}",\n\1parameters=PARAMETERS,\n'),
        (r"(TaskRecord\n)(?=\n\n@hookimpl)", rf"\1\nPARAMETERS = {literal(parameters)}\n"),
    )  # fmt: skip
    made.carry(f"actions, observations, rewards, success of {old.name}", f"plugin.py: task {example.task}, PARAMETERS")
    for what, how in example.differences.items():
        made.differ(what, how)
    (sources / "task.py").unlink()
    _edit(folder / "pyproject.toml", (r'(  "frobs-sim-mujoco)', rf"{_REQUIREMENT}\1"))
    _edit(
        folder / "tests" / f"test_{context['name']}_task.py",
        (r"\n\n\ndef test_the_goal_can_be_set(?s:.*)", "\n"),
        (r"import gymnasium as gym\n\n", ""),
    )
    where = f"`src/{sources.name}/floor_plan.yaml`" if example.floor_plan else "`PARAMETERS`"
    _edit(
        folder / "README.md",
        (r"\| the initial state of episodes .*\n", f"| initial states and goals | {where} |\n"),
        (r"\| the observation \| .*\n", f"| rewards, tolerances | `src/{sources.name}/plugin.py`, `PARAMETERS` |\n"),
        (r"\| (the reward|the end of an episode|obstacles, cameras).*\n", ""),
        (r"\| the trained policy", rf"| meaning of `PARAMETERS` | `frobs show {example.task}` |\n| the trained policy"),
    )


def _needs(record: TaskRecord) -> str:
    return "{" + ", ".join(f'"{name}": Level.{level.name}' for name, level in record.needs.items()) + "}"


def _edit(file: Path, *changes: tuple[str, str]) -> None:
    """Replace the matches of regular expressions in a rendered file. Each expression must match."""
    text = file.read_text("utf-8")
    for pattern, new in changes:
        text, count = re.subn(pattern, new, text)
        assert count, f"{file.name} has no {pattern}"
    file.write_text(text, "utf-8")
