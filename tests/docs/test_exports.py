"""The public names of every distribution: what ``__all__`` lists exists, and what a package exports is listed."""

from __future__ import annotations

import ast
import importlib
import sys
import types
from collections.abc import Iterator
from pathlib import Path

import pytest
from pages import DOCS

sys.path.insert(0, str(DOCS))

from layers import distributions

PACKAGES = {package.name: package for found in distributions().values() for package in found.packages}


def sources() -> Iterator[tuple[str, Path]]:
    """Yield the name and the file of each module, without importing any."""
    for package in PACKAGES.values():
        for path in sorted(package.rglob("*.py")):
            parts = path.relative_to(package.parent).with_suffix("").parts
            if all(part.isidentifier() for part in parts):
                yield ".".join(part for part in parts if part != "__init__"), path


SOURCES = dict(sources())
WITH_ALL = [
    name
    for name, path in SOURCES.items()
    if "\n__all__" in path.read_text("utf-8")
    and not (name + ".").startswith(("frobs_rl.", "frobs_rl_compat.overlay."))  # these names are FRobs_RL's
]
IMPORTS_NEED = {"frobs_sim_gazebo.available": ["gazebo"]}
"""Modules that can be imported only where something is installed, and what."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.needs(*IMPORTS_NEED[name])) if name in IMPORTS_NEED else name
        for name in WITH_ALL
    ],
)
def test_all_equals_what_is_there(name: str) -> None:
    module = importlib.import_module(name)
    there = {
        key
        for key, value in vars(module).items()
        if not key.startswith("_")
        and key != "TYPE_CHECKING"
        and not isinstance(value, types.ModuleType)
        and getattr(value, "__module__", name).startswith(name)
    }
    assert there <= set(module.__all__)
    assert [key for key in module.__all__ if not hasattr(module, key)] == []
    assert sorted(module.__all__) == sorted(set(module.__all__))


@pytest.mark.parametrize("package", PACKAGES)
def test_modules_have_a_docstring(package: str) -> None:
    silent = [
        name
        for name, path in SOURCES.items()
        if name.partition(".")[0] == package and not ast.get_docstring(ast.parse(path.read_text("utf-8")))
    ]
    assert silent == []


def test_the_reference_covers_the_public_modules() -> None:
    """The modules of the API reference exist, and each of its packages lists its names."""
    from generate.api import MODULES

    listed = [module for modules in MODULES.values() for module in modules]
    assert [module for module in listed if module not in SOURCES] == []
    packages = [module for module in listed if SOURCES[module].name == "__init__.py"]
    assert [module for module in packages if module not in WITH_ALL] == []
