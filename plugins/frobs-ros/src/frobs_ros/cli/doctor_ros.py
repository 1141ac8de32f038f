"""Implements ``frobs doctor ros``, which checks the ROS installation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from frobs_cli.options import Json
from frobs_cli.output import console, print_json, print_line, print_table

if TYPE_CHECKING:
    from rich.text import Text


def ros(json: Json = False) -> None:
    """Check which parts of ROS and Gazebo are installed, and whether a ROS master responds.

    For each missing part, the output shows the package that provides it. The exit status is 1 if a part that frobs-ros
    requires is missing.

    Example:
        $ frobs doctor ros
        $ frobs doctor ros --json
    """
    from rich.text import Text

    from frobs_ros.ros.doctor import examine_ros

    report = examine_ros()
    if json:
        print_json(report)
    else:
        rows: list[list[str | Text]] = []
        for part in report.parts:
            state = Text("found", style="green") if part.found else Text("missing", style=_style(part.needed))
            about = part.version or part.place if part.found else f"apt-get install {part.package}" * bool(part.package)
            rows.append([part.name, state, part.purpose, about or "–"])
        print_table(("part", "state", "purpose", "version, path or fix"), rows)
        print_line()
        for line in report.advice:
            console().print(Text(line), soft_wrap=True)
        verdict = "ROS can be used" if report.usable else "ROS cannot be used"
        console().print(Text(verdict, style="bold green" if report.usable else "bold red"), soft_wrap=True)
    if not report.usable:
        raise typer.Exit(1)


def _style(needed: bool) -> str:
    return "bold red" if needed else "yellow"
