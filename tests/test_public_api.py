"""What a distribution imports of another one is public there; docs/explanation/api-stability.md says what is public.

A public name is in ``__all__`` of the package that the import names, or in a single module that the reference lists.
"""

from __future__ import annotations

import ast
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))

from generate import api, errors, ros
from layers import ROOT, Distribution, distributions

OWNERS = {package.name: found for found in distributions().values() for package in found.packages}
MODULES = {
    *(module for modules in api.MODULES.values() for module in modules),
    *errors.MODULES,
    *("frobs_core.plugins.hooks", "frobs_core.plugins.records"),  # the pages of hooks and records
    *(f"frobs_rl_compat.ros.{module}" for module in ros.TABLES["functions"]),
}
"""Modules that the reference lists."""

BUILT_ON = {
    "frobs-algos-sbx": ("frobs-algos-sb3",),
    "frobs-data": ("frobs-train",),
    "frobs-ray": ("frobs-train",),
    "frobs-rl-compat": ("frobs-ros", "frobs-algos-sb3"),
}
"""Distributions that use the inside of another one, and require exactly its version."""


def source(module: str) -> Path | None:
    """Return the file of one of our modules; None: there is no such module."""
    package = next(path for path in OWNERS[module.partition(".")[0]].packages if path.name == module.partition(".")[0])
    base = package.parent.joinpath(*module.split("."))
    return next((path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file()), None)


@cache
def exported(module: str) -> set[str] | None:
    """Return what a module's ``__all__`` lists, without importing it; None: it has none.

    In ``__all__ = [*_MODULES]`` the names are the keys of a mapping, which are imported when they are first used. With
    ``__all__, __getattr__ = lazy_names(…)`` they are what the package imports for type checkers.
    """
    path = source(module)
    tree = ast.parse(path.read_text("utf-8")) if path else ast.Module([], [])
    if any(isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("lazy_names(") for node in tree.body):
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        return {alias.name for node in imports if str(node.module).startswith(f"{module}.") for alias in node.names}
    values = {
        node.targets[0].id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
    }
    if "__all__" not in values:
        return None
    names = []
    for element in values["__all__"].elts:
        names += values[element.value.id].keys if isinstance(element, ast.Starred) else [element]
    return {name.value for name in names}


def is_public(module: str, name: str) -> bool:
    names = exported(module)
    if names is not None:
        return name in names or name.startswith("__") or (name == "*" and module in MODULES)
    return module in MODULES


def violations(distribution: Distribution) -> Iterator[str]:
    """Yield each import of another distribution's name that is not public there."""
    for path in distribution.sources():
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and not node.level and node.module:
                wanted = [(node.module, alias.name) for alias in node.names]
            elif isinstance(node, ast.Import):
                wanted = [(alias.name, "*") for alias in node.names]
            else:
                continue
            for module, name in wanted:
                if OWNERS.get(module.partition(".")[0], distribution) == distribution or is_public(module, name):
                    continue
                if f"{module}.{name}" not in MODULES and exported(f"{module}.{name}") is None:
                    yield f"{path.relative_to(ROOT)}:{node.lineno}: {name} of {module}"


@pytest.mark.parametrize("name", distributions())
def test_imports_of_other_distributions_are_public(name: str) -> None:
    inside = [f" of {below.replace('-', '_')}" for below in BUILT_ON.get(name, (name,))]
    found = [line for line in violations(distributions()[name]) if not any(each in line for each in inside)]
    assert found == []


@pytest.mark.parametrize(("name", "below"), [(name, below) for name, known in BUILT_ON.items() for below in known])
def test_who_uses_the_inside_of_a_distribution_requires_its_version(name: str, below: str) -> None:
    project = tomllib.loads((ROOT / "plugins" / name / "pyproject.toml").read_text("utf-8"))["project"]
    required = next(one for one in project["dependencies"] if one.startswith(below))
    assert required.endswith(f"=={project['version']}")


def test_what_is_exported_is_found() -> None:
    assert exported("frobs_train") >= {"Run", "train"}
    assert exported("frobs_data") >= {"Dataset", "merge"}
    assert exported("frobs_view") >= {"BrowserViewer", "ViewServer"}
    assert exported("frobs_core.models") >= {"RobotModel"}
    assert exported("frobs_core.util.errors") is None
    assert not is_public("frobs_models.xmltree", "Element")
    assert is_public("frobs_models", "Element")
