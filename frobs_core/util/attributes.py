"""Imports attributes by name."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def load_attribute(name: str) -> Any:
    """Import a module and return one of its attributes.

    Args:
        name: ``"module:attribute"``.

    Raises:
        ImportError: The module cannot be imported.
        AttributeError: The module has no such attribute.
        ValueError: The name of the module is empty.
    """
    module, _, attribute = name.partition(":")
    return getattr(import_module(module), attribute)
