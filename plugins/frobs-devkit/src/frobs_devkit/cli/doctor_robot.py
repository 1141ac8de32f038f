"""``frobs doctor robot``: finds problems in a robot's model file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.model_options import PackagePath, XacroArgs, package_paths, xacro_args
from frobs_cli.options import Attach, Gripper, Json
from frobs_cli.output import only_json, print_json, print_note
from frobs_core.kernel.robot_file import is_robot_file, read_robot_file
from frobs_core.util.files import write_text
from frobs_devkit.cli.doctor_report import print_report


def robot(
    file: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            show_default=False,
            help="Robot to examine: a URDF, xacro or MJCF file, 'package:path' in a Python package, a YAML file that "
            "--write wrote, or a name from 'frobs list robots'.",
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
    gripper: Gripper = None,
    attach: Attach = None,
    write: Annotated[
        Path | None,
        typer.Option(
            metavar="YAML",
            show_default=False,
            dir_okay=False,
            help="Write a description of the robot and its gripper, with reasons and units, to this new file. You can edit "
            "it and use it in place of the model file.",
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
        $ frobs doctor robot arm.urdf --write robot.yaml
    """
    from frobs_devkit.doctor import examine_robot

    given, folders = xacro_args(args), package_paths(package_path)
    if write is not None and write.exists():
        raise CommandLineError("--write", f"'{write}' exists already; choose another name.")
    with only_json(json):
        report = examine_robot(
            file,
            xacro_args=given,
            package_paths=folders,
            simulators=simulator or (),
            gripper=None if gripper is None else {"joints": gripper.split(",")},
            attach=attach,
        )
    if write is not None:
        from frobs_devkit.doctor.robot_file import robot_file_text

        own: dict[str, Any] = dict(read_robot_file(file)) if is_robot_file(file) else {"robot": file}
        for key, value in (("xacro_args", given), ("package_paths", folders)):
            own[key] = {**own.get(key, {}), **value}
        own["attach"] = attach or own.get("attach")
        described = own.pop("robot")
        text = robot_file_text(report, described, {key: value for key, value in own.items() if value}, write)
        write_text(write, text)
        print_note(f"written: {write}")
    if json:
        print_json(report)
    else:
        print_report(report)
    if not report.usable:
        raise typer.Exit(1)
