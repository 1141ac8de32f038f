"""Prints facts about an object, with scalars as labeled values and lists as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from frobs_cli.output import console, one_line, print_line, print_table, print_title

_HEADINGS = {
    "max_episode_steps": "max steps",
    "help": "meaning",
    "entry_point": "entry point",
    "lacks": "what is missing",
}


def print_facts(facts: Mapping[str, Any]) -> None:
    """Write facts to stdout: a title with ``kind`` and ``name``, then the scalars, then a section for each table.

    Args:
        facts: Facts about an object, in the form that commands also write as JSON. Values that are None or empty are
            omitted from the output.
    """
    from rich.text import Text

    out = console()
    print_title(str(facts["name"]), str(facts["kind"]))
    if facts.get("summary"):
        out.print(Text(f"  {one_line(facts['summary'])}"), soft_wrap=not out.is_terminal)
    shown = {key: value for key, value in facts.items() if key not in ("kind", "name", "summary")}
    scalars = {key: value for key, value in shown.items() if not is_table(value) and not is_empty(value)}
    if scalars:
        print_line()
        print_table(("", ""), [[heading(key), text(value)] for key, value in scalars.items()], header=False)
    for key, value in shown.items():
        if is_table(value) and not is_empty(value):
            print_line()
            print_title(f"  {heading(key)}")
            _print_section(value)


def heading(key: str) -> str:
    """Return the human-readable label for a key."""
    return _HEADINGS.get(key, key.replace("_", " "))


def text(value: Any) -> str:
    """Return a value as human-readable text similar to YAML, with floats rounded to six significant digits."""
    from frobs_core.util.plain import plain

    value = plain(value)
    if value is None:
        return "–"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        joined = ", ".join(text(item) for item in value)
        return joined if value and all(isinstance(item, str) for item in value) else f"[{joined}]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {text(item)}" for key, item in value.items()) + "}"
    return str(value)


def is_table(value: Any) -> bool:
    """Return whether a value is a mapping or a list of mappings, which is printed as a section."""
    return isinstance(value, Mapping) or (isinstance(value, Sequence) and bool(value) and isinstance(value[0], Mapping))


def is_empty(value: Any) -> bool:
    """Return whether a value is None or empty, and is therefore omitted from the output."""
    return value is None or (isinstance(value, (str, Sequence, Mapping)) and not len(value))


def dotted(mapping: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Flatten a nested ``mapping``. The keys of the result are ``prefix`` and dotted paths, as ``--set`` accepts."""
    flat: dict[str, Any] = {}
    for key, value in mapping.items():
        if isinstance(value, Mapping) and value:
            flat |= dotted(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def _print_section(value: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> None:
    if isinstance(value, Mapping):
        rows = [[key, text(item)] for key, item in dotted(value).items()]
        print_table(("", ""), rows, header=False, indent=4)
        return
    keys = [key for key in value[0] if _is_worth_a_column(key, [row[key] for row in value])]
    print_table([heading(key) for key in keys], [[text(row[key]) for key in keys] for row in value], indent=4)


def _is_worth_a_column(key: str, values: Sequence[Any]) -> bool:
    return any(values) if key == "required" else not all(is_empty(value) for value in values)
