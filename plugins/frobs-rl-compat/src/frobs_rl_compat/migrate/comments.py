"""TODO comments that mark where to port old methods in the generated files."""

from __future__ import annotations

import ast
import textwrap

_WIDTH = 116


def todo(text: str, indent: int) -> list[str]:
    """Return the lines of a TODO comment."""
    margin = " " * indent
    return [f"{margin}# {line}" for line in textwrap.wrap(f"TODO: {text}", _WIDTH - indent)]


def insert_todo(text: str, name: str, comment: str) -> str:
    """Return a file's text with a TODO comment at the top of a method's body, or above the attribute of a class."""
    definition = _definition(text, name)
    assert definition is not None
    if isinstance(definition, ast.FunctionDef):
        first = definition.body[0]
        documented = ast.get_docstring(definition) is not None
        after, indent = (first.end_lineno or first.lineno) if documented else first.lineno - 1, first.col_offset
    else:
        after, indent = definition.lineno - 1, definition.col_offset
    lines = text.splitlines()
    return "\n".join([*lines[:after], *todo(comment, indent), *lines[after:]]) + "\n"


def defines(text: str, name: str) -> bool:
    """Return whether a file defines a method, or an annotated attribute of a class, with this name."""
    return _definition(text, name) is not None


def _definition(text: str, name: str) -> ast.FunctionDef | ast.AnnAssign | None:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.name == name:
            return node
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.target.id == name:
            return node
    return None
