from __future__ import annotations

import importlib
import inspect
import types
from pathlib import Path

import pytest

import frobs_core


def sources(package: types.ModuleType) -> dict[str, str]:
    """Return the text of each module by name, without importing any."""
    found = {package.__name__: Path(package.__file__ or "").read_text("utf-8")}
    for path in sorted(Path(package.__path__[0]).rglob("*.py")):
        parts = path.relative_to(package.__path__[0]).with_suffix("").parts
        name = ".".join([package.__name__, *(part for part in parts if part != "__init__")])
        found[name] = path.read_text("utf-8")
    return found


SOURCES = sources(frobs_core)
MODULES = [name for name in SOURCES if not name.endswith("__main__")]
WITH_ALL = [name for name in MODULES if "\n__all__" in SOURCES[name]]


@pytest.mark.parametrize("name", WITH_ALL)
def test_all_equals_what_is_there(name: str) -> None:
    module = importlib.import_module(name)
    there = {
        key
        for key, value in vars(module).items()
        if not key.startswith("_")
        and not isinstance(value, types.ModuleType)
        and getattr(value, "__module__", name).startswith(name)
    }
    assert there <= set(module.__all__)
    assert [key for key in module.__all__ if not hasattr(module, key)] == []
    assert sorted(module.__all__) == sorted(set(module.__all__))


@pytest.mark.parametrize("name", MODULES)
def test_modules_say_what_they_hold(name: str) -> None:
    assert inspect.getdoc(importlib.import_module(name))
