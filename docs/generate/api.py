"""A page for each public module of the core."""

import ast
import pkgutil
from pathlib import Path

import frobs_core
from generate.rst import directive, escape, heading, label, table, toctree

_ELSEWHERE = {"cli", "errors", "hookspecs", "specs"}
"""Modules with a page of their own in the reference."""


def modules() -> list[str]:
    """Return the names of the public modules, without the package."""
    names = (module.name for module in pkgutil.iter_modules(frobs_core.__path__))
    return sorted(name for name in names if not name.startswith("_") and name not in _ELSEWHERE)


def page() -> str:
    """Return the page that lists the modules."""
    rows = [(f":doc:`frobs_core.{name} <api/{name}>`", escape(_summary(name))) for name in modules()]
    text = label("api") + heading("Python modules")
    text += "The public modules of ``frobs_core``; what a name with a leading underscore holds may change.\n\n"
    return text + table(["module", "what it holds"], rows) + toctree((f"api/{name}" for name in modules()), hidden="")


def pages() -> dict[str, str]:
    """Return a page for each module."""
    return {f"api/{name}": _page(name) for name in modules()}


def _page(name: str) -> str:
    package = (Path(frobs_core.__path__[0]) / name).is_dir()
    options = {"members": "", **({"imported_members": ""} if package else {})}
    return heading(f"frobs_core.{name}") + directive("automodule", f"frobs_core.{name}", **options)


def _summary(name: str) -> str:
    """Return the first line of a module's docstring, which is read and not imported."""
    base = Path(frobs_core.__path__[0]) / name
    source = base / "__init__.py" if base.is_dir() else base.with_suffix(".py")
    return (ast.get_docstring(ast.parse(source.read_text())) or "").partition("\n")[0]
