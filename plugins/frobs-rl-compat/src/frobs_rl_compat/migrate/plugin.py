"""Writes the skeleton of a FRobs plugin for a FRobs_RL package."""

from __future__ import annotations

import math
import os
import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from frobs_cli.errors import TargetExistsError
from frobs_core.description import Lidar
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.plain import to_json
from frobs_devkit.scaffold import copy_model, render, resolve
from frobs_rl_compat.migrate.advice import note_the_task, note_what_is_left
from frobs_rl_compat.migrate.comments import todo
from frobs_rl_compat.migrate.migration import Migration
from frobs_rl_compat.migrate.package import OldPackage, read_package
from frobs_rl_compat.migrate.robot import RobotSource, find_robot
from frobs_rl_compat.migrate.task import edit_task
from frobs_rl_compat.migrate.yaml_files import run_configuration

STILL = "observation_elements_vary"
"""Name of the check that fails if an arm's tool cannot move along all axes."""


def migrate_package(
    path: Path,
    out: Path,
    *,
    name: str | None = None,
    id: str | None = None,
    namespace: str = "lab",
    package_paths: Mapping[str, str | Path] | None = None,
) -> Migration:
    """Write the skeleton of a plugin for a FRobs_RL package. If an error occurs, no plugin is created.

    Args:
        path: Folder of the ROS package, whose code is parsed but never imported.
        out: Folder in which to create the plugin's folder.
        name: Name of the new robot and task. Defaults to the package's name.
        id: ID of the environment to migrate. Defaults to a task that a training script uses, or else to the first
            registered task.
        namespace: Namespace of the new ID, before the slash.
        package_paths: Folders of ROS packages that are neither next to this package nor in ``ROS_PACKAGE_PATH``, by
            package name.

    Raises:
        ConfigurationError: The package contains no FRobs_RL environment, the plugin's folder already exists, or one of
            the plugin's names is already in use.
        UnknownNameError: The package does not register the environment ID.
    """
    package = read_package(path, id)
    robot, problem = find_robot(package, package_paths or {})
    made = Migration(package.name, out)
    context = resolve(_answers(package, robot, name, namespace))
    target = out / context["__folder"]
    if target.exists() or target.is_symlink():
        raise TargetExistsError(target, "choose another --name, or another folder with --out")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out, prefix=".frobs-migrate-") as aside:
        folder = render(context, Path(aside))
        sources = folder / "src" / context["__package"]
        _edit_robot(package, robot, problem, sources, context["name"], made)
        new_id = _edit_plugin(package, folder, sources, context, made)
        note_the_task(package, robot, made)
        edit_task(package, sources / "task.py", made)
        _copy_numbers(package, sources, made)
        _write_learning(package, folder, new_id, made)
        note_what_is_left(package, made)
        made.path = target
        run = Path("runs") / context["name"]
        made.next = [
            f"pip install -e {target}",
            f"pytest {target}",
            f"frobs train {new_id} --config {target / 'train.yaml'} --seed 0 --run-dir {run}",
            f"read {target / 'MIGRATION.md'}",
        ]
        (folder / "MIGRATION.md").write_text(made.markdown(), "utf-8")
        os.rename(folder, target)
    return made


def _answers(package: OldPackage, robot: RobotSource | None, name: str | None, namespace: str) -> dict[str, str]:
    """Return the answers to the questions that ``frobs new`` asks."""
    plain = re.sub(r"[^a-z0-9]+", "_", package.name.lower()).strip("_")[:40].strip("_")
    answers = {"what": "both", "name": name or (plain if plain[:1].isalpha() else f"robot_{plain}"),
               "namespace": namespace}  # fmt: skip
    if robot is None:
        return {**answers, "example": "arm"}
    if robot.wheels is not None:
        return {**answers, "example": "wheeled"}
    return {
        **answers,
        "example": "file",
        "robot_file": str(robot.path.absolute()),
        "failing_checks": "expect",  # the migrated robot is kept even if checks fail
        "xacro_args": " ".join(f"{key}:={value}" for key, value in robot.xacro_args.items()),
        "package_paths": os.pathsep.join(f"{key}={Path(folder).absolute()}" for key, folder in robot.package_paths.items()),
    }  # fmt: skip


def _edit_robot(
    package: OldPackage, robot: RobotSource | None, problem: str, sources: Path, name: str, made: Migration
) -> None:
    file = sources / "robot.py"
    if robot is None:
        made.leave(
            "the robot's file",
            f"{problem}; robot.py contains a two-joint arm as a placeholder, so replace it with your robot",
        )
        lines = todo(f"describe the package's robot here, because its model file could not be used: {problem}", 0)
        text = file.read_text("utf-8")
        file.write_text(
            text.replace(f"\n{name.upper()} = Robot(", "\n" + "\n".join(lines) + f"\n{name.upper()} = Robot(")
        )
        return
    made.carry(f"{robot.path.name}, macros expanded, with its meshes", f"src/{sources.name}/{name}.urdf")
    made.leave(
        "the tool and the home position",
        "check the values of tcp, home and the drive gains in robot.py, because they are guesses",
    )
    if robot.lidar_problem:
        made.leave("the lidar", f"robot.py: sensors; {robot.lidar_problem}")
    if robot.wheels is None:
        for axis in robot.still_axes:
            made.leave(
                f"the tool never moves along {axis}",
                "in task.py, remove this component of the tool and goal positions from observation_terms; until you "
                f"remove it, the `{STILL}` tests fail",
            )
        return
    wheels = robot.wheels
    copy_model(robot.model, sources / f"{name}.urdf")
    (sources / f"{name}.urdf.xacro").unlink()
    text = file.read_text("utf-8").replace(f"{name}.urdf.xacro", f"{name}.urdf")
    for old, new in (
        (r'left=\("[^"]*",\)', f'left=("{wheels.left}",)'),
        (r'right=\("[^"]*",\)', f'right=("{wheels.right}",)'),
        (r"separation=[0-9.]+", f"separation={wheels.separation:g}"),
        (r"wheel_radius=[0-9.]+", f"wheel_radius={wheels.diameter / 2:g}"),
        (r'tcp="base_link"', f'tcp="{robot.base_link}"'),
        (r"    friction=.*\n", _friction_text(robot.friction)),
        (r"    # sensors=.*\n", _lidars_text(robot.lidars)),
    ):  # fmt: skip
        text, count = re.subn(old, new, text)
        if not count:
            raise ValueError(f"the scaffold of a robot has no text that matches {old!r}")
    if robot.lidars:
        text = text.replace("DriveGains, Robot", "DriveGains, Lidar, Robot")
    file.write_text(text, "utf-8")
    readme = sources.parent.parent / "README.md"
    readme.write_text(readme.read_text("utf-8").replace(f"{name}.urdf.xacro", f"{name}.urdf"), "utf-8")
    made.carry("wheels of the Gazebo plugin", "robot.py: differential_drive")
    if robot.friction:
        made.carry(f"friction of {', '.join(robot.friction)}", "robot.py: friction")
    if robot.lidars:
        made.carry(f"lidar {', '.join(robot.lidars)}", "robot.py: sensors")


def _friction_text(friction: Mapping[str, float]) -> str:
    if not friction:
        return "    # TODO: set friction={link: 0.0} for sliding casters\n"
    rows = "".join(f'        "{link}": {value!r},\n' for link, value in friction.items())
    return f"    friction={{\n{rows}    }},\n"


def _lidars_text(lidars: Mapping[str, Lidar]) -> str:
    rows = ""
    for name, lidar in lidars.items():
        values = {each.name: getattr(lidar, each.name) for each in fields(lidar)
                  if getattr(lidar, each.name) != each.default}  # fmt: skip
        shown = "".join(f"            {key}={_literal(value)},\n" for key, value in values.items())
        rows += f'        "{name}": Lidar(\n{shown}        ),\n'
    note = "    # tasks read these sensors with frobs_core.sensing.sensors.Sensors\n"
    return f"{note}    sensors={{\n{rows}    }},\n" if rows else '    # sensors={"scan": Lidar(frame="base_link", …)}\n'


def _literal(value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return to_json(value, ascii=False) if isinstance(value, str) else repr(value)


def _edit_plugin(package: OldPackage, folder: Path, sources: Path, context: Mapping[str, Any], made: Migration) -> str:
    """Set the environment's ID and time limit, add a comment about the old actions, and return the ID."""
    old_id = package.registration.id if package.registration else context["__id"]
    stem = re.sub(r"-v[0-9]+$", "", old_id.rpartition("/")[2])
    new_id = f"{context['namespace']}/{stem}Skeleton-v0"
    for path in folder.rglob("*"):
        if path.is_file() and path.suffix in (".py", ".md", ".yaml", ".yml", ".toml"):
            text = path.read_text("utf-8")
            if context["__id"] in text:
                path.write_text(text.replace(context["__id"], new_id), "utf-8")
    made.leave(
        f"ID {old_id}",
        f"{new_id} is a skeleton; after you port the old task's world, rewards and success condition to task.py, "
        "remove 'Skeleton' from the ID",
    )
    file = sources / "plugin.py"
    text = file.read_text("utf-8")
    registered = package.registration.max_episode_steps if package.registration else None
    limits = [limit for limit in (max(package.time_limits, default=0), registered) if limit]
    if limits:
        text = re.sub(r"max_episode_steps=[0-9]+", f"max_episode_steps={min(limits)}", text)
        said = f"registered {registered}" + (
            f", TimeLimitWrapper {max(package.time_limits)}" if package.time_limits else ""
        )
        made.carry(f"limit on steps ({said})", f"plugin.py: max_episode_steps={min(limits)}")
    old = package.hook("_send_action")
    if old is not None:
        advice = (
            f"choose a controller that is equivalent to {old.place('_send_action')}; list all controllers with "
            "'frobs list controllers'."
        )
        head, at, rest = text.partition("                    controller=")
        text = head + "\n".join(todo(advice, 20)) + "\n" + at + rest
        made.leave(old.place("_send_action"), "choose a controller in plugin.py")
    file.write_text(text, "utf-8")
    return new_id


def _copy_numbers(package: OldPackage, sources: Path, made: Migration) -> None:
    """Copy the YAML files with the old task's parameters, as a reference for porting the task."""
    for path in package.yaml.numbers:
        parts = path.relative_to(package.folder).parts
        shutil.copyfile(path, sources / "_".join(parts))
        made.carry("/".join(parts), f"src/{sources.name}/{'_'.join(parts)}, unchanged; no module reads it")


def _write_learning(package: OldPackage, folder: Path, id: str, made: Migration) -> None:
    """Convert each training file to a run configuration. The file that training scripts load becomes ``train.yaml``."""
    scripts = [calls for path in package.scripts for calls in package.python.calls[path].values()]
    named = {getattr(keyword.value, "value", None) for calls in scripts for call in calls
             for keyword in call.keywords if keyword.arg == "config_filename"}  # fmt: skip
    files = sorted(package.yaml.learning, key=lambda path: (path.name not in named, path.name))
    for number, path in enumerate(files):
        try:
            text, note = run_configuration(path, package.yaml.learning[path], id)
        except ConfigurationError as error:
            made.leave(path.name, str(error))
            continue
        name = "train.yaml" if number == 0 else f"train_{path.stem}.yaml"
        (folder / name).write_text(text, "utf-8")
        made.carry(f"{path.name}: training, noise, networks", name)
        if note:
            made.leave(f"keys of {path.name}", note.removeprefix(f"{path}: "))
