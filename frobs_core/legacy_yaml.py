"""Reading the task YAML of FRobs_RL: everything under one key, of which some means nothing here."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from frobs_core.errors import ConfigFileError, ConfigurationError, nearest
from frobs_core.yaml import find_origin


def read_section(
    document: Mapping[str, Any],
    path: str | Path,
    root: str,
    used: Mapping[str, Callable[[str, Any], Any]],
    ignored: Sequence[str] = (),
) -> dict[str, Any]:
    """Return the values of a task's file that mean something, and refuse what is unknown.

    Args:
        document: The file, as :func:`frobs_core.yaml.load_yaml` reads it.
        path: The file, for messages.
        root: The key that the file has everything under.
        used: Keys that mean something, with what checks and reads a value, given the key and the value.
        ignored: Keys that such files have and that change nothing.

    Raises:
        ConfigFileError: A key is unknown or a value cannot be used; names file, line and the nearest key.
    """
    for key in document:
        if key != root:
            raise ConfigFileError(path, _line(document, key), f"unknown key '{key}'; the file must hold '{root}:'.")
    section = document.get(root)
    if not isinstance(section, Mapping):
        raise ConfigFileError(path, _line(document, root), f"must hold a mapping under '{root}:'.")
    values = {}
    for key, value in section.items():
        if key in used:
            try:
                values[key] = used[key](key, value)
            except ConfigurationError as error:
                raise ConfigFileError(path, _line(section, key), str(error)) from error
        elif key not in ignored:
            known = [*used, *ignored]
            suggestion = nearest(str(key), known)
            hint = f" Did you mean '{suggestion}'?" if suggestion else ""
            raise ConfigFileError(path, _line(section, key), f"unknown key '{key}'.{hint} Known: {', '.join(known)}.")
    return values


def _line(mapping: Mapping[str, Any], key: str) -> int | None:
    origin = find_origin(mapping, [key])
    return None if origin is None else origin[1]
