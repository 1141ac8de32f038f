"""``frobs migrate``: convert a package or a YAML file of FRobs_RL to a plugin or a run configuration."""

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
            help="ID of the environment to migrate, as the package registers it.",
        ),
    ] = None,
    namespace: Annotated[str, typer.Option(metavar="NAME", help="First part of the new Gymnasium ID.")] = "lab",
    package_path: PackagePath = None,
    json: Json = False,
) -> None:
    """Convert a package of FRobs_RL to a plugin, or its YAML file to a run configuration.

    The package is read, never imported. The plugin installs and trains without edits, with the package's own robot. If
    the package's task is one of FRobs_RL's example tasks, with the same or other numbers, the plugin has the same task:
        its observation, rewards, success, walls and waypoints. For any other package, the task is a skeleton, and its
        ID ends in Skeleton-v0. TODO comments mark where to port the old methods, and original.py has the old spaces and
        numbers. MIGRATION.md lists what was migrated, what works differently, and what was not migrated. Nothing is
        overwritten.

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
