"""Implements ``frobs show``, which shows the details of an object."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import gymnasium as gym
import typer

from frobs_cli import catalogue
from frobs_cli.describe_environment import describe_environment, readable_environment
from frobs_cli.describe_record import describe_extension, describe_record
from frobs_cli.describe_robot import describe_file, robot_of
from frobs_cli.errors import CommandLineError
from frobs_cli.facts import print_facts
from frobs_cli.model_options import RobotChoice
from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note, working
from frobs_cli.providers import Provider, providers
from frobs_core import plugins
from frobs_core.kernel.robot_file import is_robot_file
from frobs_core.models import is_model_file
from frobs_core.plugins import registry
from frobs_core.plugins.records import KINDS
from frobs_core.util.errors import MissingDependencyError, UnknownNameError
from frobs_core.util.yaml import dump_yaml

Facts = dict[str, Any]


def show(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            show_default=False,
            help="What to show: a simulator, robot, controller, task or algorithm, an environment ID, a capability, "
            "sensor type, parameter or command, a run folder, or a robot's model file (URDF, xacro, MJCF). If a name "
            "has several meanings, write KIND:NAME.",
        ),
    ],
    choice: RobotChoice,
    config: Annotated[
        bool, typer.Option("--config", help="For a run, show only its settings, as YAML for 'frobs train --config'.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(
            metavar="PNG",
            help="For a robot: draw it at its home position and at its joint limits, and save the image to this file.",
        ),
    ] = None,
    cameras: Annotated[
        Path | None,
        typer.Option(
            metavar="PNG",
            help="For an environment ID: draw what each camera sees after a reset, and save the image to this file.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Show the details of a part, an environment ID, an extension, a run or a robot file.

    A part is a simulator, robot, controller, task or algorithm. The details of a part include the accepted parameters,
    the required capabilities, and what the part is compatible with. With --robot FILE, the details of an environment ID
    include the gripper that was found in the file, and how the task was fitted to the robot.

    Example:
        $ frobs show irb120
        $ frobs show frobs/Irb120Reach-v0
        $ frobs show controller:joint_position
        $ frobs show sensor_type:lidar
        $ frobs show runs/first --config
        $ frobs show arm.urdf --picture arm.png
        $ frobs show frobs/PandaPickAndPlace-v0 --cameras cameras.png
        $ frobs show frobs/PickAndPlace-v0 --robot arm.urdf
    """
    with only_json(json):
        keywords = choice.keywords()
        robot = robot_of(name, {key: keywords[key] for key in keywords if key != "robot"})
        if choice.robot or choice.attach:
            _check_id(name, "--robot, --attach")
            descriptions = [describe_environment(registry.find_spec(name), keywords)]
        elif robot is not None and (is_model_file(name) or is_robot_file(name)):
            descriptions = [describe_file(robot)]
        elif keywords:
            raise CommandLineError(
                "--args, --package-path, --tcp, --gripper",
                f"these options require a robot's model file, but '{name}' is not a file.",
            )
        else:
            descriptions = [describe() for describe in _meanings(name)]
        if config and not any("config" in facts for facts in descriptions):
            raise CommandLineError("--config", f"this option requires a run folder, but '{name}' is none.")
        if picture is not None:
            if robot is None:
                raise CommandLineError(
                    "--picture", f"'{name}' cannot be drawn, because it is neither a robot nor a robot's model file."
                )
            _draw("a robot", lambda provider: provider.draw(robot, picture))
        if cameras is not None:
            _check_id(name, "--cameras")
            _draw("cameras", lambda provider: provider.draw_cameras(name, keywords, cameras))
    if json:
        print_json(descriptions)
        return
    for i, facts in enumerate(descriptions):
        if i:
            print_line()
        if config and "config" in facts:
            sys.stdout.write(dump_yaml(facts["config"]))
        else:
            print_facts(_readable(facts))
    if len(descriptions) > 1:
        ways = ", ".join(f"'{facts['kind']}:{name}'" for facts in descriptions)
        print_note(f"'{name}' has several meanings; to show only one of them, use {ways}")


def _readable(facts: Facts) -> Mapping[str, Any]:
    """Convert facts to human-readable form."""
    if facts["kind"] == catalogue.ENVIRONMENT:
        return readable_environment(facts)
    return next((it.readable(facts) for it in providers() if it.kind == facts["kind"]), facts)


def _draw(what: str, draw: Callable[[Provider], Path | None]) -> None:
    """Draw with the first provider that can."""
    with working("drawing"):
        written = next((file for it in providers() if (file := draw(it)) is not None), None)
    if written is None:
        raise MissingDependencyError(f"drawing {what}", ["frobs-devkit"], "pip install frobs-devkit")
    print_note(f"picture: {written}")


def _meanings(name: str) -> Iterator[Callable[[], Facts]]:
    """For each object that the name may refer to, yield a function that returns the facts about the object."""
    prefix, _, rest = name.partition(":")
    others = {it.kind: it for it in providers() if it.kind}
    kind = prefix if prefix in (*KINDS, catalogue.ENVIRONMENT, *catalogue.EXTENSIONS, *others) else None
    requested = rest if kind else name
    exists = False
    for candidate in KINDS if kind is None else [kind] if kind in KINDS else []:
        records = plugins.records(candidate)
        offered_twice = any(known.endswith(f":{requested}") for known in records)
        if requested in records or offered_twice or kind:
            exists = True
            record = plugins.get_record(candidate, requested)
            yield lambda candidate=candidate, record=record: describe_record(candidate, record)  # type: ignore[misc]
    if kind in (None, catalogue.ENVIRONMENT) and (kind or _is_id(requested)):
        exists = True
        spec = registry.find_spec(requested)
        yield lambda: describe_environment(spec)
    for other, provider in others.items():
        if kind in (None, other) and (kind or provider.describes(requested)):
            exists = True
            yield lambda provider=provider: {**provider.describe(requested)}  # type: ignore[misc]
    for other in [] if exists else catalogue.EXTENSIONS:
        extensions = {item.name: item for item in catalogue.listed(other)} if kind in (None, other) else {}
        if requested in extensions:
            exists = True
            yield lambda other=other, item=extensions[requested]: describe_extension(other, item)  # type: ignore[misc]
        elif kind == other:
            raise UnknownNameError(other.replace("_", " "), requested, extensions, catalogue.problems())
    if not exists:
        names = {known for kind in KINDS for known in plugins.records(kind)} | set(registry.environments())
        hints = (plugins.active().install_hint(kind, name) for kind in (*KINDS, "environment"))
        hint = next(filter(None, hints), "")
        raise UnknownNameError("record or environment ID", name, names, catalogue.problems(), hint)


def _check_id(name: str, options: str) -> None:
    if not _is_id(name):
        raise CommandLineError(options, f"an environment ID is required, but '{name}' is none.")


def _is_id(name: str) -> bool:
    """Return whether a name is an environment ID, with or without a module to import (``module:Id-v0``)."""
    return registry.bare_id(name) in gym.registry or (":" in name and "/" in name)
