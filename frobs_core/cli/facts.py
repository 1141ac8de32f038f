"""Facts about one thing, on the screen: scalars as label and value, lists as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from frobs_core.cli.output import console, plain, print_line, print_table, print_title

_HEADINGS = {
    "max_episode_steps": "max steps",
    "help": "meaning",
    "entry_point": "entry point",
}


def print_facts(facts: Mapping[str, Any]) -> None:
    """Write facts to stdout: ``kind`` and ``name`` as the title, then what is scalar, then a section for each table.

    Args:
        facts: What a command also writes as JSON. None and what is empty is left out.
    """
    from rich.text import Text

    out = console()
    print_title(str(facts["name"]), str(facts["kind"]))
    if facts.get("summary"):
        out.print(Text(f"  {facts['summary']}"), soft_wrap=not out.is_terminal)
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
    """Return a key as people read it."""
    return _HEADINGS.get(key, key.replace("_", " "))


def text(value: Any) -> str:
    """Return a value as people read it: a number with as many digits as it means, a list with commas."""
    value = plain(value)
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return ", ".join(text(item) for item in value)
    if isinstance(value, dict):
        return ", ".join(f"{key}: {text(item)}" for key, item in value.items())
    return str(value)


def is_table(value: Any) -> bool:
    """Tell what becomes a section: a mapping, or a list of mappings."""
    return isinstance(value, Mapping) or (isinstance(value, Sequence) and bool(value) and isinstance(value[0], Mapping))


def is_empty(value: Any) -> bool:
    """Tell what is not worth a line."""
    return value is None or (isinstance(value, (str, Sequence, Mapping)) and not len(value))


def _print_section(value: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> None:
    if isinstance(value, Mapping):
        print_table(("", ""), [[str(key), text(item)] for key, item in value.items()], header=False, indent=4)
        return
    keys = [key for key in value[0] if any(not is_empty(row[key]) for row in value)]
    print_table([heading(key) for key in keys], [[text(row[key]) for key in keys] for row in value], indent=4)
