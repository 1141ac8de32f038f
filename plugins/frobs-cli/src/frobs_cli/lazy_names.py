"""Imports the public names of a package when they are first used."""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy_names(package: str, file: str) -> tuple[list[str], Callable[[str], Any]]:
    """Return the names for ``__all__``, and the function for ``__getattr__``, of a package.

    The public names are those that the package's ``__init__.py`` imports for type checkers, so that each is listed once::

        if TYPE_CHECKING:
            from acme_wave.waves import Wave as Wave

        __all__, __getattr__ = lazy_names(__name__, __file__)

    Args:
        package: Name of the package.
        file: Its ``__init__.py``.
    """
    nodes = ast.walk(ast.parse(Path(file).read_text("utf-8")))
    modules = {
        alias.name: node.module
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith(f"{package}.")
        for alias in node.names
    }

    def find(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(modules[name]), name)

    return sorted(modules), find
