"""Detects name clashes between a new plugin and installed plugins."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec

import gymnasium as gym

from frobs_core import plugins
from frobs_core.description import Robot
from frobs_core.plugins import registry
from frobs_core.util.errors import UnsuitableRobotError
from frobs_devkit.scaffold.errors import NameTakenError


def check_clashes(context: Mapping[str, str]) -> None:
    """Raise an error unless a new plugin's names are unused, and a new task's robot is installed and suitable.

    The context contains the answers, and the values that ``cookiecutter.json`` derives from the answers.
    """
    for distribution in context["__distributions"].split():
        with suppress(PackageNotFoundError):
            raise NameTakenError("distribution", distribution, f"version {version(distribution)} is installed")
        package = distribution.replace("-", "_")
        if find_spec(package) is not None:
            raise NameTakenError("Python package", package, "it can be imported")
    for kind in context["__kinds"].split():
        name = context["__task"] if kind == "task" else context["name"]
        offered = [known for known in plugins.records(kind) if known.rpartition(":")[2] == name]
        if offered:
            report = plugins.get_report(kind, offered[0])
            raise NameTakenError(kind, name, f"{report.origin} provides it")
    id = context["__id"]
    if id and (id in gym.registry or id in registry.environments()):
        raise NameTakenError("ID", id, "it is registered")
    if context["what"] == "task":
        _check_robot(context["robot"], context["example"])


def _check_robot(name: str, example: str) -> None:
    robot: Robot = plugins.get_record("robot", name).load()
    if example == "wheeled" and robot.differential_drive is None:
        wheeled = [known for known, record in plugins.records("robot").items() if record.load().differential_drive]
        there = "no wheeled robot is installed; create one with the type 'pair'"
        if wheeled:
            there = f"installed wheeled robots: {', '.join(wheeled)}"
        raise UnsuitableRobotError(name, f"has no differential drive, so it cannot drive to a goal; {there}.")
    if example == "arm" and robot.base == "wheeled":
        raise UnsuitableRobotError(name, "is a wheeled robot; create its task with the example 'wheeled'.")
