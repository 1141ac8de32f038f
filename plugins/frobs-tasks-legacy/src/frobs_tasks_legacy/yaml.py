"""Reading the task YAML of FRobs_RL: everything under one key, of which some means nothing here."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias

from frobs_core.errors import ConfigFileError, ConfigurationError, UnknownNameError, nearest
from frobs_core.yaml import find_origin, load_yaml

Readers: TypeAlias = Mapping[str, Callable[[str, Any], Any]]
"""Keys that mean something, with what checks and reads a value, given the key and the value."""


@dataclass(frozen=True, kw_only=True)
class TaskFiles:
    """The task YAML of one kind of FRobs_RL's tasks.

    Attributes:
        folder: Of this package, whose ``tasks/NAME.yaml`` has FRobs_RL's own values.
        kind: What a name is, for messages.
        roots: The key under which a file has everything, by name.
        used: Keys that mean something.
        ignored: Keys that such files have and that change nothing here.
    """

    folder: str
    kind: str
    roots: Mapping[str, str]
    used: Readers
    ignored: Sequence[str]

    def read(self, name: str, config_file: str | Path | None, keywords: Mapping[str, Any]) -> dict[str, Any]:
        """Return a value for each key that is used: a keyword's, else the file's, else FRobs_RL's own.

        Args:
            name: Of :attr:`roots`.
            config_file: A task YAML of FRobs_RL, unchanged; None: none.
            keywords: By key; those that are None are not given, and others are ignored.

        Raises:
            ConfigFileError: The file cannot be read, or has an unknown key or an unusable value; names file and line.
            ConfigurationError: A keyword has an unusable value.
            UnknownNameError: There is no such name.
        """
        if name not in self.roots:
            raise UnknownNameError(self.kind, name, self.roots)
        own = Path(str(files("frobs_tasks_legacy"))) / self.folder / "tasks" / f"{name}.yaml"
        paths = (own,) if config_file is None else (own, config_file)
        return read_values(paths, self.roots[name], self.used, self.ignored, keywords)


def read_values(
    paths: Iterable[str | Path], root: str, used: Readers, ignored: Sequence[str], keywords: Mapping[str, Any]
) -> dict[str, Any]:
    """Return a value for each key that a keyword or a file gives.

    Args:
        paths: The files; a later one goes before an earlier one.
        root: The key that a file has everything under.
        used: What can be given.
        ignored: Keys that such files have and that change nothing.
        keywords: By key, which go before the files; those that are None are not given, and others are ignored.

    Raises:
        ConfigFileError: A file cannot be read, or has an unknown key or an unusable value; names file, line and the
            nearest key.
        ConfigurationError: A keyword has an unusable value.
    """
    values: dict[str, Any] = {}
    for path in paths:
        values |= _read_section(path, root, used, ignored)
    return values | {
        name: check(name, keywords[name]) for name, check in used.items() if keywords.get(name) is not None
    }


def _read_section(path: str | Path, root: str, used: Readers, ignored: Sequence[str]) -> dict[str, Any]:
    document = load_yaml(path)
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
