"""Facts as ``frobs show`` says them, as reStructuredText."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from frobs_cli.facts import heading as word
from frobs_cli.facts import text
from generate.rst import code, escape, table

_CODE = {"entry_point", "action_space", "observation_space", "name", "default", "id", "joint", "model", "simulator"}
_TITLES = {"kind", "name", "summary", "error"}


def scalars(facts: Mapping[str, Any]) -> str:
    """Return a table of label and value."""
    rows = [(word(key), _cell(key, value)) for key, value in facts.items() if key not in _TITLES and _is_scalar(value)]
    return table([], rows, widths="25 75") if rows else ""


def tables(facts: Mapping[str, Any], skip: Sequence[str] = ()) -> str:
    """Return a captioned table for each list of facts."""
    pieces = []
    for key, value in facts.items():
        if key in skip or not _is_table(value):
            continue
        pieces.append(f".. rubric:: {word(key).capitalize()}\n\n")
        columns = [column for column in value[0] if column != "required" or any(row[column] for row in value)]
        pieces.append(
            table([word(column) for column in columns], [[_cell(c, row[c]) for c in columns] for row in value])
        )
    return "".join(pieces)


def _cell(key: str, value: Any) -> str:
    shown = " ".join(text(value).split())
    if key == "help":
        return re.sub(r"\\\*(\w+)\\\*", r"*\1*", escape(shown))  # from a docstring, which may stress a word
    return code(shown) if key in _CODE and shown not in ("", "–") else escape(shown)


def _is_table(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, Mapping) for row in value)


def _is_scalar(value: Any) -> bool:
    return value not in (None, "", [], {}) and not _is_table(value)
