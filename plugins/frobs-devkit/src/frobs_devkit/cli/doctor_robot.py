"""``frobs doctor robot``: finds problems in a robot's model file."""

from __future__ import annotations

from typing import Annotated

import typer

from frobs_cli.model_options import PackagePath, XacroArgs, package_paths, xacro_args
from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json
from frobs_devkit.cli.doctor_report import print_report


def robot(
    file: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            show_default=False,
            help="Robot to examine: a URDF, xacro or MJCF file, 'package:path' in a Python package, or a name from "
            "'frobs list robots'.",
        ),
    ],
    args: XacroArgs = None,
    package_path: PackagePath = None,
    simulator: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", show_default="all installed", help="Simulator in which to check the robot. Repeatable."
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Examine a robot's model file: joints, masses, shapes, drives, and how each simulator represents the robot.

    Each finding includes advice on how to fix the problem. Exits with status 1 if a finding prevents the use of the
    robot, and with status 2 if the file cannot be read.

    Example:
        $ frobs doctor robot arm.urdf
        $ frobs doctor robot irb120
        $ frobs doctor robot arm.urdf.xacro --args gripper:=true
        $ frobs doctor robot arm.urdf --package-path ~/ros/src --json
    """
    from frobs_devkit.doctor import examine_robot

    with only_json(json):
        report = examine_robot(
            file, xacro_args=xacro_args(args), package_paths=package_paths(package_path), simulators=simulator or ()
        )
    if json:
        print_json(report)
    else:
        print_report(report)
    if not report.usable:
        raise typer.Exit(1)
