"""Reads all information about one environment from a FRobs_RL package."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from frobs_core.util.errors import UnknownNameError
from frobs_rl_compat.migrate.migration import MigrationError
from frobs_rl_compat.migrate.python_files import (
    OldClass,
    PythonFiles,
    Registration,
    last_name,
    read_file,
    read_python_files,
)
from frobs_rl_compat.migrate.yaml_files import YamlFiles, read_yaml_files
from frobs_rl_compat.ros.robot_settings import RobotSettings

_NAME = re.compile(r"<name>\s*([\w-]+)\s*</name>")


@dataclass(frozen=True)
class OldPackage:
    """Information about a package that can be determined without running its code.

    Attributes:
        name: Name from ``package.xml``, or else the name of the folder.
        lineage: The environment's class, followed by its base classes from the same package.
        registration: Registration of the environment's ID, or None if the environment is not registered.
        others: IDs of the other tasks that the package registers.
        robot_arguments: Arguments of ``RobotBasicEnv`` that the constructors state as literals, by name.
        scripts: Files that create the environment, with training scripts first, or all files if no file creates the
            environment.
    """

    name: str
    folder: Path
    lineage: list[OldClass]
    registration: Registration | None
    others: list[str]
    robot_arguments: Mapping[str, Any]
    python: PythonFiles
    yaml: YamlFiles
    scripts: list[Path]

    def hook(self, name: str) -> OldClass | None:
        """Return the class that implements a method, or None if the method is missing or only raises an error."""
        old = next((each for each in self.lineage if name in each.methods), None)
        return old if old is not None and old.does(name) else None

    def calls(self, name: str) -> list[ast.Call]:
        """Return the calls to a function in the scripts."""
        return [call for path in self.scripts for call in self.python.calls[path].get(name, [])]

    @property
    def time_limits(self) -> list[int]:
        """Value of ``max_steps`` for each ``TimeLimitWrapper`` in the scripts."""
        limits: list[Any] = []
        for call in self.calls("TimeLimitWrapper"):
            given = [keyword.value for keyword in call.keywords if keyword.arg == "max_steps"] + call.args[1:2]
            limits += [value.value for value in given if isinstance(value, ast.Constant)]
        return [value for value in limits if isinstance(value, int)]

    @property
    def wrappers(self) -> list[str]:
        """Names of FRobs_RL's normalization wrappers that the scripts use."""
        names = ("NormalizeActionWrapper", "NormalizeObservationWrapper", "NormalizeObservWrapper")
        return [name for name in names if self.calls(name)]


def read_package(folder: Path, id: str | None = None) -> OldPackage:
    """Read a package from its folder."""
    if not folder.is_dir():
        raise MigrationError(
            folder, "this path is neither a folder nor a file; pass the folder of a ROS package or a YAML file."
        )
    python = read_python_files(folder)
    environments = python.environments
    if not environments:
        there = ", ".join(old.name for old in python.classes) or "none"
        raise MigrationError(
            folder,
            f"no class inherits from FRobs_RL's RobotBasicEnv; the classes are: {there}. Pass the folder of the ROS "
            "package.",
        )
    registered = [each for each in python.registrations if python.registered(each) in environments]
    if id is not None and id not in [each.id for each in registered]:
        raise UnknownNameError(f"ID in {folder}", id, [each.id for each in registered])
    candidates = [each for each in registered if id in (None, each.id)]
    registration = min(candidates, key=lambda each: _rank(each, python), default=None)
    cls = python.registered(registration) if registration else None
    lineage = python.lineage(cls) if cls else max(map(python.lineage, environments), key=len)
    scripts = _scripts(python, registration.id if registration else "")
    others = dict.fromkeys(each.id for each in registered if each is not registration and not _is_base(each, python))
    return OldPackage(
        name=_package_name(folder),
        folder=folder,
        lineage=lineage,
        registration=registration,
        others=list(others),
        robot_arguments=_robot_arguments(lineage),
        python=python,
        yaml=read_yaml_files(folder),
        scripts=scripts or list(python.calls),
    )


def _is_base(registration: Registration, python: PythonFiles) -> bool:
    """Return whether an environment is only a base class, from which another class in the package inherits."""
    old = python.registered(registration)
    return any(old in python.lineage(other)[1:] for other in python.classes)


def _rank(registration: Registration, python: PythonFiles) -> tuple[bool, bool, int]:
    """Return a sort key that puts tasks before base classes, and environments that scripts train before all others."""
    scripts = _scripts(python, registration.id)
    trained = [number for number, path in enumerate(python.calls) if path in scripts and "train" in python.calls[path]]
    return _is_base(registration, python), not scripts, trained[0] if trained else len(python.calls)


def _scripts(python: PythonFiles, id: str) -> list[Path]:
    """Return the files that create an environment by its ID, with training scripts first."""
    makes = [
        path
        for path, calls in python.calls.items()
        if any(isinstance(arg, ast.Constant) and arg.value == id for call in calls.get("make", []) for arg in call.args)
    ]
    return sorted(makes, key=lambda path: "train" not in python.calls[path])


def _robot_arguments(lineage: Sequence[OldClass]) -> dict[str, Any]:
    """Return the literals that constructors pass to ``RobotBasicEnv`` or assign to variables with an argument's name."""
    names = RobotSettings.names()
    arguments: dict[str, Any] = {}
    for constructor in (old.methods["__init__"] for old in reversed(lineage) if "__init__" in old.methods):
        for node in ast.walk(constructor):
            values: list[tuple[str | None, ast.expr]] = []
            if isinstance(node, ast.Assign):
                values = [(last_name(target), node.value) for target in node.targets]
            elif isinstance(node, ast.Call) and last_name(node.func) == "__init__":
                values = [(keyword.arg, keyword.value) for keyword in node.keywords]
            for name, value in values:
                if name in names and isinstance(value, ast.Constant | ast.List | ast.Tuple | ast.UnaryOp):
                    with suppress(ValueError, TypeError):
                        arguments[name] = ast.literal_eval(value)
    return arguments


def _package_name(folder: Path) -> str:
    file = folder / "package.xml"
    match = _NAME.search(read_file(file).decode("utf-8", "replace")) if file.is_file() else None
    return match[1] if match else folder.absolute().name
