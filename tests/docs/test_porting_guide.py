"""The porting guide from 0.1: each name that it recommends exists, and no name that it replaces does."""

from __future__ import annotations

import importlib
import re

import pytest
from pages import DOCS

ROWS = re.findall(
    r"^\| `(frobs_[\w.]+)` \| `(frobs_[\w.]+)` \|$", (DOCS / "how-to" / "port-from-0.1.md").read_text(), re.M
)


def find(name: str) -> object:
    """Return a module, or an attribute of a module."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        module, _, attribute = name.rpartition(".")
        return getattr(importlib.import_module(module), attribute)


def test_the_tables_are_read() -> None:
    assert len(ROWS) > 60


@pytest.mark.parametrize(("old", "new"), ROWS, ids=[old for old, _ in ROWS])
def test_new_names_exist_and_old_ones_do_not(old: str, new: str) -> None:
    assert find(new) is not None
    with pytest.raises((ImportError, AttributeError)):
        find(old)


def test_every_public_name_of_training_exists() -> None:
    import frobs_train

    assert [name for name in frobs_train.__all__ if not hasattr(frobs_train, name)] == []
