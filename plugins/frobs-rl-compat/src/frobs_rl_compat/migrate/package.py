"""All that a package of FRobs_RL says of one environment."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from frobs_core.errors import UnknownNameError
from frobs_rl_compat.migrate.constructor import Constructed, construct
from frobs_rl_compat.migrate.errors import MigrationError
from frobs_rl_compat.migrate.python_files import OldClass, PythonFiles, Registration, read_python_files
from frobs_rl_compat.migrate.yaml_files import YamlFiles, read_yaml_files

_NAME = re.compile(r"<name>\s*([\w-]+)\s*</name>")


@dataclass(frozen=True)
class OldPackage:
    """A package, as far as it can be read.

    Attributes:
        name: In ``package.xml``, or of the folder.
        lineage: The environment's class, and those of the package that it inherits.
        registration: Its ID; None: it is not registered.
        others: Further IDs that the package registers.
        time_limits: ``max_steps`` of each ``TimeLimitWrapper`` in the scripts.
        wrappers: Names of FRobs_RL's other wrappers that the scripts use.
    """

    name: str
    folder: Path
    lineage: list[OldClass]
    registration: Registration | None
    others: list[str]
    constructed: Constructed
    python: PythonFiles
    yaml: YamlFiles
    time_limits: list[int]
    wrappers: list[str]

    def hook(self, name: str) -> tuple[OldClass, list[str]] | None:
        """Return the class that has a method and the lines of its body; None where it is missing or only refuses."""
        for old in self.lineage:
            if name in old.methods:
                lines = old.text(name)
                return None if not lines or lines[0].startswith("raise NotImplemented") else (old, lines)
        return None


def read_package(folder: Path, id: str | None = None) -> OldPackage:
    """Read a package.

    Raises:
        ConfigurationError: There is no such folder, no environment of FRobs_RL in it, or it cannot be read.
        UnknownNameError: The package does not register the ID.
    """
    if not folder.is_dir():
        raise MigrationError(
            folder, "this is neither a folder nor a file; pass the folder of a ROS package or a YAML file."
        )
    python = read_python_files(folder)
    environments = {old.name: old for old in python.environments}
    if not environments:
        there = ", ".join(python.classes) or "no class at all"
        raise MigrationError(
            folder, f"no class inherits FRobs_RL's RobotBasicEnv; there is {there}. Give the folder of the ROS package."
        )
    registered = [each for each in python.registrations if each.class_name in environments]
    if id is not None and id not in [each.id for each in registered]:
        raise UnknownNameError(f"ID in {folder}", id, [each.id for each in registered])
    registration = next((each for each in registered if id in (None, each.id)), None)
    lineages = {name: python.lineage(name) for name in environments}
    chosen = registration.class_name if registration else max(lineages, key=lambda name: len(lineages[name]))
    yaml = read_yaml_files(folder)
    return OldPackage(
        name=_package_name(folder),
        folder=folder,
        lineage=lineages[chosen],
        registration=registration,
        others=[each.id for each in registered if each is not registration],
        constructed=construct(lineages[chosen], yaml.parameter),
        python=python,
        yaml=yaml,
        time_limits=_time_limits(python),
        wrappers=[name for name in ("NormalizeActionWrapper", "NormalizeObservationWrapper", "NormalizeObservWrapper")
                  if name in python.calls],
    )  # fmt: skip


def _package_name(folder: Path) -> str:
    file = folder / "package.xml"
    found = _NAME.search(file.read_text("utf-8", errors="replace")) if file.is_file() else None
    return found[1] if found else folder.absolute().name


def _time_limits(python: PythonFiles) -> list[int]:
    found: list[Any] = []
    for call in python.calls.get("TimeLimitWrapper", []):
        given = [keyword.value for keyword in call.keywords if keyword.arg == "max_steps"] + call.args[1:2]
        found += [value.value for value in given if isinstance(value, ast.Constant) and isinstance(value.value, int)]
    return found
