from __future__ import annotations

import importlib
import inspect
import pkgutil
import types

import pytest

import frobs_core

MODULES = [
    name for _, name, _ in pkgutil.walk_packages(frobs_core.__path__, "frobs_core.") if not name.endswith("__main__")
]
WITH_ALL = ["frobs_core", *(name for name in MODULES if hasattr(importlib.import_module(name), "__all__"))]


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
