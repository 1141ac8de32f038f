"""The command ``frobs migrate``, which writes a plugin's skeleton for a FRobs_RL package, or converts a YAML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.model_options import PackagePath
from frobs_cli.options import Json


def migrate(
    path: Annotated[
        Path,
        typer.Argument(metavar="PATH", show_default=False, help="Folder of the ROS package, or one of its YAML files."),
    ],
    out: Annotated[
        Path,
        typer.Option(
            metavar="FOLDER",
            show_default="the current folder",
            help="Folder in which to create the new folder or file.",
        ),
    ] = Path(),
    name: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", show_default="the package's name", help="Name of the new robot and task, such as my_arm."
        ),
    ] = None,
    id: Annotated[
        str | None,
        typer.Option(
            metavar="ID",
            show_default="the task that a script trains",
            help="ID under which the package registers the environment to migrate.",
        ),
    ] = None,
    namespace: Annotated[
        str, typer.Option(metavar="NAME", help="Namespace of the new Gymnasium ID (the part before the slash).")
    ] = "lab",
    package_path: PackagePath = None,
    json: Json = False,
) -> None:
    """Write the skeleton of a plugin for a FRobs_RL package, or convert one of its YAML files to a run configuration.

    The package's code is parsed but never imported. The plugin uses the package's own robot and converted training
    files, and can be installed and used for training without edits. Its task is a placeholder, whose ID ends in
    Skeleton-v0. TODO comments in the skeleton mark where to port the old methods. MIGRATION.md lists which parts were
    migrated and which were not, and names the FRobs ID that reproduces the package's task if the task has the name of a
    FRobs_RL example. Existing files are never overwritten.

    Example:
        $ frobs migrate ~/catkin_ws/src/my_arm_rl --out plugins
        $ frobs migrate ~/catkin_ws/src/my_arm_rl/config/td3.yaml
    """
    from frobs_cli.facts import print_facts
    from frobs_cli.model_options import package_paths
    from frobs_cli.output import only_json, print_json, print_line, print_title
    from frobs_rl_compat.migrate import migrate_package, migrate_yaml

    with only_json(json):
        if path.is_file():
            made = migrate_yaml(path, out)
        else:
            made = migrate_package(
                path, out, name=name, id=id, namespace=namespace, package_paths=package_paths(package_path)
            )
    if json:
        print_json(made.facts())
        return
    print_facts(made.facts() | {"next": None})
    print_line()
    print_title("  next")
    for command in made.next:
        print_line(f"    {command}")
