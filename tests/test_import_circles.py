"""No circle of imports inside a distribution, and rooms of the core that import only the rooms below them."""

from __future__ import annotations

import ast
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))

from layers import distributions

ROOMS = ("util", "plugins", "models", "description", "contracts", "sensing", "kernel")
"""Rooms of the core, from the lowest to the highest."""

PACKAGES = sorted(package for distribution in distributions().values() for package in distribution.packages)


def modules(package: Path) -> dict[str, Path]:
    """Return the source file of each module of a package, by name."""
    return {
        ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__"): path
        for path in package.rglob("*.py")
    }


def imported_at_module_level(tree: ast.AST) -> list[str]:
    """Return the names of all modules, and of all members of modules, that are imported when a module is imported."""
    names: list[str] = []
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module}.{alias.name}" for alias in node.names]
        elif not (
            isinstance(node, ast.FunctionDef) or (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test))
        ):
            names += imported_at_module_level(node)
    return names


def graph(package: Path) -> dict[str, set[str]]:
    """Return the modules of a package that each of its modules imports."""
    files = modules(package)
    edges = {}
    for module, path in files.items():
        names = imported_at_module_level(ast.parse(path.read_text("utf-8")))
        edges[module] = {name if name in files else name.rpartition(".")[0] for name in names} & files.keys() - {module}
    return edges


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_a_package_has_no_circle_of_imports(package: Path) -> None:
    try:
        TopologicalSorter(graph(package)).prepare()
    except CycleError as error:
        pytest.fail(" → ".join(error.args[1]))


def test_rooms_of_the_core_import_only_lower_rooms() -> None:
    edges = graph(Path(__file__).parents[1] / "frobs_core")
    assert {module.split(".")[1] for module in edges if module.count(".") > 1} == set(ROOMS)

    def room(module: str) -> int:
        name = ([*module.split("."), ""])[1]
        return ROOMS.index(name) if name in ROOMS else -1

    upward = [
        f"{module} → {other}" for module, others in edges.items() for other in others if 0 <= room(module) < room(other)
    ]
    assert upward == []
