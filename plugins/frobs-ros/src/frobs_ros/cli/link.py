"""``frobs ros link``: ROS's modules into a virtual environment."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.output import print_line, print_note


def link(
    venv: Annotated[
        Path | None,
        typer.Option(metavar="PATH", show_default="the one that runs this", help="The virtual environment."),
    ] = None,
    undo: Annotated[bool, typer.Option("--undo", help="Take the links away again.")] = False,
) -> None:
    """Make 'import rospy' work in a virtual environment, by links to ROS's modules and to nothing else.

    The links stand in a folder of their own, which a .pth file names; what the environment has installed comes first.
    Run it again after installing more of ROS. FRobs itself finds ROS without it: it is for scripts that import rospy.

    Example:
        $ frobs ros link
        $ frobs ros link --venv ~/venv
        $ frobs ros link --undo
    """
    from frobs_ros.link import link_modules, site_packages, unlink_modules

    site = site_packages(venv)
    if undo:
        gone = unlink_modules(site)
        print_line(f"ROS's modules are no longer linked into {site}" if gone else f"nothing was linked into {site}")
        return
    linked = link_modules(site)
    print_line(f"{len(linked.modules)} modules of {linked.source} are linked into {linked.folder}")
    if linked.borrowed:
        print_note(f"with what they import and {site} lacks: {', '.join(linked.borrowed)}")
