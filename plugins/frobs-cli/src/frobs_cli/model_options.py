"""Options for commands that read a model file: xacro arguments and ROS packages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.options import Attach, Gripper, Robot, Tcp
from frobs_models import package_name

XacroArgs = Annotated[
    list[str] | None,
    typer.Option("--args", metavar="NAME:=VALUE", show_default=False, help="Argument of the xacro file. Repeatable."),
]

PackagePath = Annotated[
    list[str] | None,
    typer.Option(
        metavar="[NAME=]FOLDER",
        show_default=False,
        help="Folder of a ROS package that the model file refers to, or folder that contains several such packages. "
        "Repeatable.",
    ),
]


ROBOT_FLAGS = ("robot", "tcp", "gripper", "attach")
"""Names of the options that are keywords of an environment."""


@dataclass(frozen=True, kw_only=True)
class RobotChoice:
    """Options of commands that build an environment with another robot."""

    robot: Robot = None
    tcp: Tcp = None
    gripper: Gripper = None
    attach: Attach = None
    args: XacroArgs = None
    package_path: PackagePath = None

    def keywords(self) -> dict[str, Any]:
        """Return the keywords of an environment.

        Raises:
            CommandLineError: An argument does not have the form ``name:=value``, or a folder does not exist.
        """
        paths = {name: str(folder) for name, folder in package_paths(self.package_path).items()}
        keywords = {name: getattr(self, name) for name in ROBOT_FLAGS}
        keywords |= {"xacro_args": xacro_args(self.args), "package_paths": paths}
        return {name: value for name, value in keywords.items() if value}


def xacro_args(given: Sequence[str] | None) -> dict[str, str]:
    """Return the ``given`` xacro arguments by name. A string may contain several arguments, separated by spaces.

    Raises:
        ConfigurationError: An argument does not have the form ``name:=value``.
    """
    arguments = {}
    for word in (word for text in given or () for word in text.split()):
        name, sign, value = word.partition(":=")
        if not (name and sign):
            raise CommandLineError("--args", f"'{word}' is not of the form NAME:=VALUE.")
        arguments[name] = value
    return arguments


def package_paths(given: Sequence[str] | None) -> dict[str, str | Path]:
    """Return the ``given`` ROS package folders by package name.

    Raises:
        ConfigurationError: A folder does not exist.
    """
    paths: dict[str, str | Path] = {}
    for text in given or ():
        name, sign, value = text.partition("=")
        folder = Path(value if sign else text).expanduser()
        if not folder.is_dir():
            raise CommandLineError("--package-path", f"'{folder}' is not a folder; write FOLDER or NAME=FOLDER.")
        if sign:
            paths[name] = folder
        else:
            inside = sorted(child for child in folder.iterdir() if child.is_dir())
            paths |= {package_name(candidate): candidate for candidate in [*inside, folder]}
    return paths
