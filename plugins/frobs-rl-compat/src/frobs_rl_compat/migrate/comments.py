"""TODO comments that mark where to port old methods in the generated files."""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Sequence

_WIDTH = 116


def todo(text: str, indent: int) -> list[str]:
    """Return the lines of a TODO comment."""
    margin = " " * indent
    return [f"{margin}# {line}" for line in textwrap.wrap(f"TODO: {text}", _WIDTH - indent)]


def insert_in_method(text: str, method: str, lines: Sequence[str]) -> str:
    """Return a file's text with lines inserted at the top of a method's body, below the docstring."""
    function = next(
        node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef) and node.name == method
    )  # fmt: skip
    documented = ast.get_docstring(function) is not None
    first = function.body[0]
    after = (first.end_lineno or first.lineno) if documented else first.lineno - 1
    all_lines = text.splitlines()
    return "\n".join([*all_lines[:after], *lines, *all_lines[after:]]) + "\n"


def has_method(text: str, method: str) -> bool:
    """Return whether a file defines a method."""
    return any(isinstance(node, ast.FunctionDef) and node.name == method for node in ast.walk(ast.parse(text)))
