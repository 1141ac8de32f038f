"""Which distributions import which, read from their sources; nothing is imported for it.

``docs/generate/architecture.py`` draws the result, and ``tests/test_layers.py`` compares it with the allowed layers.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
_OBJECT = re.compile(r"(\w+)(\.\w+)*:[\w./]+")
"""An object or file in a module, as a string: ``"frobs_train.cli.train:train"``."""


@dataclass(frozen=True)
class Distribution:
    """A distribution of this repository.

    Attributes:
        name: Name on the package index: ``"frobs-sim-mujoco"``.
        folder: Folder of its ``pyproject.toml``.
        packages: Folders of its import packages.
        project: The table ``project`` of its ``pyproject.toml``.
    """

    name: str
    folder: Path
    packages: tuple[Path, ...]
    project: dict[str, Any] = field(compare=False)

    def sources(self) -> Iterator[Path]:
        """Yield the Python files of its import packages."""
        for package in self.packages:
            yield from sorted(package.rglob("*.py"))

    def requirements(self) -> set[str]:
        """Return the names of all required distributions, those of extras included."""
        extras = self.project.get("optional-dependencies", {}).values()
        lines = [line for group in (self.project["dependencies"], *extras) for line in group]
        return {re.split(r"[<>=\[; ]", line)[0].lower() for line in lines}


@cache
def distributions() -> dict[str, Distribution]:
    """Return the distributions of this repository by name: the core first, then by name."""
    found = {}
    for file in [ROOT / "pyproject.toml", *sorted(ROOT.glob("plugins/*/pyproject.toml"))]:
        table = tomllib.loads(file.read_text("utf-8"))
        wheel = table["tool"]["hatch"]["build"]["targets"]["wheel"]
        packages = tuple(file.parent / package for package in wheel.get("packages", ()))
        name = table["project"]["name"]
        found[name] = Distribution(name, file.parent, packages, table["project"])
    return found


@cache
def imports(distribution: Distribution) -> dict[str, set[str]]:
    """Return each top-level package that a distribution imports, with the places, ``"file:line"``.

    Imports inside functions count, and so do ``import_module("…")`` and objects in strings, ``"module:object"``.
    """
    ours = {package.name for other in distributions().values() for package in other.packages}
    places = defaultdict(set)
    for path in distribution.sources():
        tree = ast.parse(path.read_text("utf-8"))
        for node in ast.walk(tree):
            for package in _named(node, ours):
                places[package].add(f"{path.relative_to(ROOT)}:{node.lineno}")
    return dict(places)


def imported_distributions(distribution: Distribution) -> set[str]:
    """Return the names of the other distributions of this repository that a distribution imports."""
    owners = {package.name: other.name for other in distributions().values() for package in other.packages}
    return {owners[package] for package in imports(distribution) if package in owners} - {distribution.name}


def _named(node: ast.AST, ours: set[str]) -> Iterator[str]:
    """Yield the top-level packages that a syntax node names."""
    if isinstance(node, ast.Import):
        yield from (alias.name.partition(".")[0] for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
        yield node.module.partition(".")[0]
    elif isinstance(node, ast.Call) and _is_import_module(node.func) and node.args:
        if isinstance(node.args[0], ast.Constant) and isinstance(node.args[0].value, str):
            yield node.args[0].value.partition(".")[0]
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        match = _OBJECT.fullmatch(node.value)
        if match and match[1] in ours:
            yield match[1]


def _is_import_module(function: ast.expr) -> bool:
    return "import_module" in (getattr(function, "id", ""), getattr(function, "attr", ""))
