"""Old code as comments in new files, at the place where its work is done now."""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Sequence

_WIDTH = 116


def commented(lines: Sequence[str], indent: int, todo: str) -> list[str]:
    """Return lines as comments below a line that says what is to do."""
    margin = " " * indent
    found = [f"{margin}# {line}" for line in textwrap.wrap(f"TODO: {todo}", _WIDTH - indent)]
    for line in lines:
        if not line:
            found.append(f"{margin}#")
            continue
        inner = " " * (len(line) - len(line.lstrip()))
        wrapped = textwrap.wrap(line.strip(), max(40, _WIDTH - indent - len(inner)), break_long_words=True)
        found += [f"{margin}#     {inner}{part}" for part in wrapped]
    return [line[:120].rstrip() for line in found]


def insert_in_method(text: str, method: str, lines: Sequence[str]) -> str:
    """Return a file's text with lines at the beginning of a method's body, below its docstring."""
    function = next(
        node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef) and node.name == method
    )  # fmt: skip
    documented = ast.get_docstring(function) is not None
    first = function.body[0]
    after = (first.end_lineno or first.lineno) if documented else first.lineno - 1
    all_lines = text.splitlines()
    return "\n".join([*all_lines[:after], *lines, *all_lines[after:]]) + "\n"


def has_method(text: str, method: str) -> bool:
    """Return whether a file has a method."""
    return any(isinstance(node, ast.FunctionDef) and node.name == method for node in ast.walk(ast.parse(text)))
