"""Reads the parameters of a class from its constructor's signature and its docstring."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping
from typing import Any

_SECTIONS = ("Args:", "Attributes:")
_MARKUP = re.compile(r"(?::[\w:]+:)?`{1,2}~?([^`]*)`{1,2}")
"""Pattern for inline code and roles in reStructuredText, which captures the displayed text."""
_ENTRY = re.compile(r"^(\w+)(?:\s*\([^)]*\))?:\s*(.*)$")


def parameters(cls: type) -> list[dict[str, Any]]:
    """Return the keywords that a class's constructor accepts, including keywords that it passes to parent classes.

    Returns:
        A dictionary for each keyword, with ``name``, ``required``, ``default`` (None if required) and ``help``.
    """
    from frobs_core.util.keywords import constructor_parameters

    documented = descriptions(cls)
    rows = []
    for name, parameter in constructor_parameters(cls).items():
        required = parameter.default is inspect.Parameter.empty
        default = None if required else parameter.default
        rows.append({"name": name, "required": required, "default": default, "help": documented.get(name, "")})
    return rows


def descriptions(cls: type) -> Mapping[str, str]:
    """Return a one-line description of each parameter, from the docstrings of a class and its parent classes."""
    texts: dict[str, str] = {}
    for parent in cls.__mro__[:-1]:
        for document in (parent.__doc__, vars(parent).get("__init__", object).__doc__):
            for name, text in _entries(inspect.cleandoc(document or "")):
                texts.setdefault(name, text)
    return texts


def _entries(document: str) -> Iterator[tuple[str, str]]:
    """Yield the name and text of each entry in the ``Args`` and ``Attributes`` sections of a Google-style docstring."""
    inside, name, text = False, "", ""
    for line in [*document.splitlines(), ""]:
        entry = _ENTRY.match(line.strip()) if inside and _indent(line) == 4 else None
        if name and (entry or not line.strip() or _indent(line) <= 4):
            yield name, _MARKUP.sub(r"\1", text)
            name = ""
        if entry:
            name, text = entry[1], entry[2]
        elif name:
            text += f" {line.strip()}"
        elif line.strip() and _indent(line) == 0:
            inside = line.strip() in _SECTIONS


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())
